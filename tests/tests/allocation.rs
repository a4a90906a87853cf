//! Guards the loop from pauses: after the start no step of any node allocates. Has caught nothing yet; that steps do not
//! allocate was known by reading only.

use anhyst_ipc::NodeId;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::process;
use anhyst_scenario::{Placement, load};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting for each thread.
struct Counting;

fn count() {
    // A thread that is ending has no counter any more, and no test is interested in it.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from the same allocator.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the pointer came from the same allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of the loop's thread between tick 64 and the end of a run of the whole loop in this process.
fn allocations(file: &str, settings: &[&str]) -> u64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(file);
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let mut scenario = load(&path, &settings).unwrap();
    scenario.placement = Placement::Embedded;
    scenario.recording.on = false;
    scenario.duration_s = 0.2;
    let results = tempfile::tempdir().unwrap();
    let folder = RunFolder::create(Some(results.path()), "allocation").unwrap();
    let mut counts = Vec::with_capacity(128);
    let mut note = |_tick: u64| counts.push(ALLOCATIONS.get());
    process::run(
        "embedded",
        &NodeId::LOOP_ORDER,
        &scenario,
        Some(&folder),
        None,
        &mut note,
    )
    .unwrap();
    counts.last().unwrap() - counts.first().unwrap()
}

#[test]
fn no_step_allocates() {
    let law = |name: &str| format!("estimator.law={name}");
    for (file, settings) in [
        ("milling.ron", vec![]),
        ("piezo/sine.ron", vec![]),
        ("magnet/field.ron", vec![]),
        ("milling.ron", vec![law("GaussNewton()")]),
        ("milling.ron", vec![law("Gradient()")]),
        (
            "milling.ron",
            vec!["estimator.field=Measured(play_a_per_m: 3.0)".to_owned()],
        ),
        ("milling_heavy.ron", vec![]),
        ("milling_measured_material.ron", vec![]),
        ("milling_pid_alone.ron", vec![]),
        ("milling_parameters.ron", vec![]),
        ("realtime.ron", vec![]),
    ] {
        let given: Vec<&str> = settings.iter().map(String::as_str).collect();
        assert_eq!(allocations(file, &given), 0, "{file} {settings:?}");
    }
}

// The count itself must be able to fail.
#[test]
fn an_allocation_is_counted() {
    let before = ALLOCATIONS.get();
    std::hint::black_box(vec![0_u8; 100]);
    assert_eq!(ALLOCATIONS.get(), before + 1);
}
