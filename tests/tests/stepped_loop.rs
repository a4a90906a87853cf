//! Guards the loop as one value (what an FMU steps): its tokens have the bits of an embedded run's, a clone goes on as its original,
//! and one last place of one number is seen.

use anhyst_ipc::{Digest, DigestHistory, MAX_FIELDS, Message, NodeId, Truth};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::process;
use anhyst_scenario::{Placement, Scenario, SteppedLoop, load};
use anhyst_tests::digest_history;
use std::path::Path;

fn scenario(file: &str) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(file);
    let mut scenario = load(&path, &[]).unwrap();
    scenario.placement = Placement::Embedded;
    scenario.recording.on = false;
    scenario.duration_s = 0.2;
    scenario
}

fn add<M: Message>(digest: &mut Digest, token: &M) {
    let mut words = [0; MAX_FIELDS];
    token.write_words(&mut words);
    digest.add(token.tick(), &words[..M::FIELDS.len()]);
}

/// What each sender's tokens come to, tick by tick.
#[derive(Default)]
struct Told {
    digests: [Digest; NodeId::SENDERS.len()],
    histories: [DigestHistory; NodeId::SENDERS.len()],
}

impl Told {
    fn hear(&mut self, of: &SteppedLoop) {
        for ((node, digest), history) in NodeId::SENDERS.iter().zip(&mut self.digests).zip(&mut self.histories) {
            match node {
                NodeId::Plant => {
                    add(digest, &of.rig.measurement);
                    add(digest, &of.rig.truth);
                }
                NodeId::Amplifier => add(digest, &of.rig.coil_field),
                NodeId::Estimator => add(digest, &of.control.estimate),
                NodeId::Controller => add(digest, &of.control.demand),
                NodeId::Inverse => add(digest, &of.control.field_command),
                NodeId::Guard => add(digest, &of.control.safe_field),
                other => panic!("{other} sends nothing here"),
            }
            history.push(*digest);
        }
    }
}

#[test]
fn a_stepped_loop_has_the_bits_of_its_run() {
    for file in ["milling.ron", "milling_rough.ron"] {
        let scenario = scenario(file);
        let results = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(Some(results.path()), "stepped").unwrap();
        process::run(
            "embedded",
            &NodeId::LOOP_ORDER,
            &scenario,
            Some(&folder),
            None,
            &mut |_| (),
        )
        .unwrap();
        let mut stepped = SteppedLoop::new(&scenario).unwrap();
        let (mut told, mut halfway) = (Told::default(), None);
        for tick in 0..scenario.ticks() {
            if tick == scenario.ticks() / 2 {
                halfway = Some(stepped.clone());
            }
            stepped.step(tick);
            told.hear(&stepped);
        }
        for (node, own) in NodeId::SENDERS.into_iter().zip(&told.histories) {
            let difference = digest_history(folder.path(), node).first_difference(own);
            assert_eq!(difference, None, "{file}: {node}");
        }
        let mut kept = halfway.unwrap();
        for tick in scenario.ticks() / 2..scenario.ticks() {
            kept.step(tick);
        }
        assert_eq!(kept.rig.truth, stepped.rig.truth, "{file}");
        // One last place of one number is another digest.
        let of = |token: &Truth| {
            let mut digest = Digest::default();
            add(&mut digest, token);
            digest
        };
        let mut off = stepped.rig.truth;
        off.displacement_m = off.displacement_m.next_up();
        assert_ne!(of(&off), of(&stepped.rig.truth), "{file}");
    }
}
