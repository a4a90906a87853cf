//! Guards the documentation: every `anhyst …` in README and docs is a command line that there is, what stands in a block marked
//! `sh run` runs, in this order, in one folder, and every other command of a block runs in `.ci/nightly` or says why not (`table.rs`).

mod table;

use anhyst::cli::parse;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// README and every page of the documentation.
fn pages() -> Vec<PathBuf> {
    let root = repository();
    let mut pages = vec![root.join("README.md")];
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// A line of a block, those that it is continued by joined.
struct Line {
    /// What the block's fence says; nothing of an indented one.
    fence: String,
    text: String,
}

/// All lines of a page's blocks, and the `code` in its text.
fn blocks_and_spans(page: &str) -> (Vec<Line>, Vec<&str>) {
    let (mut lines, mut spans): (Vec<Line>, _) = (Vec::new(), Vec::new());
    let (mut fence, mut continued) = (None, false);
    for line in page.lines() {
        if let Some(info) = line.strip_prefix("```") {
            fence = if fence.is_none() { Some(info) } else { None };
        } else if fence.is_some() || line.starts_with("    ") {
            let text = line.trim().trim_end_matches('\\').trim_end();
            match lines.last_mut().filter(|_| continued) {
                Some(begun) => {
                    begun.text.push(' ');
                    begun.text += text;
                }
                None => lines.push(Line {
                    fence: fence.unwrap_or_default().to_owned(),
                    text: text.replacen("cargo run --release -- ", "anhyst ", 1),
                }),
            }
            continued = line.ends_with('\\');
        } else {
            spans.extend(line.split('`').skip(1).step_by(2));
        }
    }
    (lines, spans)
}

/// Every `anhyst …` of blocks and text.
fn written(page: &str) -> Vec<String> {
    let (lines, spans) = blocks_and_spans(page);
    let lines = lines.into_iter().map(|line| line.text);
    let all = lines.chain(spans.into_iter().map(str::to_owned));
    all.filter(|text| text.starts_with("anhyst ")).collect()
}

/// What a page has the reader type, of the blocks that the gate does not run. In a block for nothing but commands every line is one; other blocks
/// have results, too.
fn typed(page: &str) -> Vec<String> {
    const PROGRAMS: [&str; 15] = [
        "ANHYST_",
        "anhyst ",
        "cargo ",
        "examples/",
        ".ci/",
        "for i in",
        "grep ",
        "iox2 ",
        "make ",
        "maturin ",
        "mdbook ",
        "perf ",
        "pip ",
        "python",
        "venv/",
    ];
    let is_command = |line: &Line| match line.fence.as_str() {
        "sh" => true,
        "" => PROGRAMS.iter().any(|program| line.text.starts_with(program)),
        _ => false,
    };
    let (lines, _) = blocks_and_spans(page);
    lines.into_iter().filter(is_command).map(|line| line.text).collect()
}

/// As a shell would, but for expansions.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote, mut any) = (Vec::new(), String::new(), None, false);
    for letter in command.chars() {
        match (quote, letter) {
            (None, '\'' | '"') => (quote, any) = (Some(letter), true),
            (Some(open), _) if letter == open => quote = None,
            (None, ' ') => {
                if any || !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
                any = false;
            }
            _ => word.push(letter),
        }
    }
    if any || !word.is_empty() {
        words.push(word);
    }
    words
}

/// A placeholder or a part that may be left out: such a line is for the reader and not for the shell.
fn is_pattern(word: &str) -> bool {
    word.contains('…') || word.contains('[') && !word.contains('=') || word.starts_with("COMMAND")
}

#[test]
fn every_documented_command_is_one() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for command in written(&text) {
            let mut words = words(&command);
            if let Some(end) = words
                .iter()
                .position(|word| ["&", "|", ">", "#", "&&", ";"].contains(&word.as_str()) || word.starts_with("2>"))
            {
                words.truncate(end);
            }
            // `anhyst run` alone is the command's name; one of a feature is there where that is built.
            let name = words.get(1).map_or("", String::as_str);
            let named_alone = words.len() == 2 || words.len() == 3 && words[1] == "study";
            let feature = words
                .iter()
                .any(|word| ["bridge", "--here", "--listen", "--connect"].contains(&word.as_str()));
            if words.iter().any(|word| is_pattern(word))
                || named_alone && anhyst::cli::command().find_subcommand(name).is_some()
            {
                continue;
            }
            if feature && !cfg!(feature = "bridge") {
                continue;
            }
            seen += 1;
            if let Err(error) = parse(words.iter().map(Into::into))
                && error.use_stderr()
            {
                let first = error.to_string().lines().next().unwrap_or_default().to_owned();
                wrong.push(format!("{}: {command}: {first}", page.display()));
            }
        }
    }
    assert!(seen > 100, "{seen}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A heading as GitHub and mdBook link to it.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase();
    let kept = kept.chars().filter(|own| own.is_alphanumeric() || "-_ ".contains(*own));
    kept.collect::<String>().trim().replace(' ', "-")
}

/// Guards the documentation's links, on GitHub and in the book that is made of it: the book has every page, and nothing else.
#[test]
fn links_lead_somewhere() {
    let root = repository();
    let summary = std::fs::read_to_string(root.join("docs/SUMMARY.md")).unwrap();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let name = page.strip_prefix(&root).unwrap().display().to_string();
        let in_book = name.strip_prefix("docs/");
        if let Some(own) = in_book.filter(|own| *own != "SUMMARY.md" && !summary.contains(&format!("({own})"))) {
            wrong.push(format!("docs/SUMMARY.md has no {own}"));
        }
        let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
        for (link, _) in links.filter(|(link, _)| !link.starts_with("http") && !link.contains(' ')) {
            seen += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() {
                page.clone()
            } else {
                page.parent().unwrap().join(file)
            };
            let Ok(target) = target.canonicalize() else {
                wrong.push(format!("{name}: {link} is not there"));
                continue;
            };
            if in_book.is_some() && !target.starts_with(root.join("docs")) {
                wrong.push(format!("{name}: {link} is outside of the book"));
            }
            let headings = || std::fs::read_to_string(&target).unwrap_or_default();
            let has = |text: String| {
                text.lines()
                    .any(|line| line.starts_with('#') && anchor(line.trim_start_matches('#')) == heading)
            };
            if !heading.is_empty() && !has(headings()) {
                wrong.push(format!("{name}: {link} is no heading"));
            }
        }
    }
    assert!(seen > 50, "{seen}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn what_is_marked_runs() {
    let root = repository();
    let mut seen = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let blocks = text
            .split("```sh run\n")
            .skip(1)
            .map(|rest| rest.split("```").next().unwrap());
        let script: String = blocks.collect();
        if script.is_empty() {
            continue;
        }
        seen += 1;
        let folder = tempfile::tempdir().unwrap();
        for own in ["scenarios", "docs"] {
            std::os::unix::fs::symlink(root.join(own), folder.path().join(own)).unwrap();
        }
        let executable = Path::new(env!("CARGO_BIN_EXE_anhyst"))
            .parent()
            .unwrap()
            .display()
            .to_string();
        let path = format!("{executable}:{}", std::env::var("PATH").unwrap());
        let output = Command::new("sh")
            .args(["-e", "-c", &script])
            .current_dir(folder.path())
            .env("PATH", path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {said}\n{script}", page.display());
    }
    assert!(seen >= 4, "{seen}");
}

/// A page's name in the table, and what it has typed.
fn typed_pages() -> Vec<(String, Vec<String>)> {
    let root = repository();
    let page = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path.strip_prefix(&root).unwrap().display().to_string(), typed(&text))
    };
    pages()
        .into_iter()
        .map(page)
        .filter(|(_, typed)| !typed.is_empty())
        .collect()
}

/// Guards the nightly script's list: whatever it would run can be run as it stands, and no row is of a command that is gone.
#[test]
fn every_command_is_run_somewhere() {
    let pages = typed_pages();
    let mut wrong = Vec::new();
    for (page, typed) in &pages {
        let before = table::before(page).concat();
        for command in typed.iter().filter(|own| table::not_run(page, own).is_none()) {
            // A name in capitals is the reader's, unless the table makes it.
            let foreign = command
                .split(|letter: char| !letter.is_alphanumeric() && !"_$".contains(letter))
                .any(|word| {
                    word.len() > 2 && word.chars().all(|letter| letter.is_ascii_uppercase()) && !before.contains(word)
                });
            if foreign || command.contains('…') {
                wrong.push(format!(
                    "{page}: {command}: let table.rs say what it needs, or why it is not run"
                ));
            }
        }
    }
    let there = |page: &str, beginning: &str| {
        let mut typed = pages.iter().filter(|(own, _)| own == page).flat_map(|(_, typed)| typed);
        typed.any(|command| command.starts_with(beginning))
    };
    let rows = table::NOT_RUN.iter().map(|row| (row.0, row.1));
    let rows = rows.chain(table::STATUS.iter().map(|row| (row.0, row.1)));
    for (page, beginning) in rows.chain(table::BEFORE.iter().map(|row| (row.0, ""))) {
        if !there(page, beginning) {
            wrong.push(format!("table.rs: {page} has no command `{beginning}…`"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// All that a page has typed, in one shell, as a reader would: a command that fails is told and the next one runs.
fn script(page: &str, commands: &[String]) -> String {
    let mut script = r#"cargo() { local command=$1; shift; command cargo "$command" --manifest-path "$REPOSITORY/Cargo.toml" "$@"; }
told() { local status=$?; echo "= $status after $((SECONDS - begun)) s" >&2; case " $1 " in *" $status "*) ;; *) echo "status $status: $2" >> FAILED; esac; }
"#
    .to_owned();
    let before = table::before(page).iter().map(|command| (*command, &[0][..]));
    let run = commands.iter().filter(|own| table::not_run(page, own).is_none());
    for (command, statuses) in before.chain(run.map(|own| (own.as_str(), table::statuses(page, own)))) {
        let shown = format!("'{}'", command.replace('\'', r"'\''"));
        let statuses: Vec<String> = statuses.iter().map(i32::to_string).collect();
        writeln!(script, "echo {shown} >&2; begun=$SECONDS").unwrap();
        // What goes on in the background has begun when the next command is typed.
        let typed = if command.ends_with('&') {
            format!("{command} sleep 5")
        } else {
            command.to_owned()
        };
        writeln!(script, "{typed}\ntold '{}' {shown}", statuses.join(" ")).unwrap();
    }
    script + "wait\n"
}

/// `ANHYST_PAGES=docs/fit.md,README.md` runs these pages alone; `ANHYST_SHARED` has the measurements.
#[test]
#[ignore = "takes hours: .ci/nightly"]
fn what_is_typed_runs() {
    let root = repository();
    let chosen = std::env::var("ANHYST_PAGES").ok();
    let shared = std::env::var_os("ANHYST_SHARED").map_or_else(|| root.join("../shared"), PathBuf::from);
    let executables = Path::new(env!("CARGO_BIN_EXE_anhyst")).parent().unwrap();
    let path = format!("{}:{}", executables.display(), std::env::var("PATH").unwrap());
    let mut failed = Vec::new();
    for (page, commands) in typed_pages() {
        if chosen
            .as_ref()
            .is_some_and(|chosen| !chosen.split(',').any(|own| own == page))
        {
            continue;
        }
        eprintln!("\n=== {page}");
        let folder = tempfile::tempdir().unwrap();
        // Copies: the gallery's page draws its pictures where they lie.
        for own in ["scenarios", "docs", "examples"] {
            let copied = Command::new("cp")
                .arg("-r")
                .args([root.join(own), folder.path().join(own)])
                .status();
            assert!(copied.unwrap().success());
        }
        std::os::unix::fs::symlink(root.join("driver"), folder.path().join("driver")).unwrap();
        std::fs::create_dir(folder.path().join("target")).unwrap();
        std::os::unix::fs::symlink(executables, folder.path().join("target/release")).unwrap();
        let status = Command::new("bash")
            .args(["-c", &script(&page, &commands)])
            .current_dir(folder.path())
            .env("PATH", &path)
            .env("REPOSITORY", &root)
            .env("ANHYST_SHARED", &shared)
            .status();
        // What a page's last command says is in the list of failures.
        status.unwrap();
        let told = std::fs::read_to_string(folder.path().join("FAILED")).unwrap_or_default();
        failed.extend(told.lines().map(|line| format!("{page}: {line}")));
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
