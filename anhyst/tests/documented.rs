//! Guards the documentation: every `anhyst …` in README and docs is a command line that there is, and what stands in a block marked
//! `sh run` runs, in this order, in one folder.

use anhyst::cli::parse;
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

/// One command a line, continued lines joined, without what the shell does with it.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined
        .lines()
        .map(|line| line.trim().replacen("cargo run --release -- ", "anhyst ", 1));
    lines.filter(|line| line.starts_with("anhyst ")).collect()
}

/// Those of blocks and of `code` in the text.
fn written(page: &str) -> Vec<String> {
    let mut blocks = String::new();
    let mut fenced = false;
    let mut spans = Vec::new();
    for line in page.lines() {
        if line.starts_with("```") {
            fenced = !fenced;
        } else if fenced || line.starts_with("    ") {
            blocks += line;
            blocks.push('\n');
        } else {
            spans.extend(
                line.split('`')
                    .skip(1)
                    .step_by(2)
                    .filter(|code| code.starts_with("anhyst "))
                    .map(str::to_owned),
            );
        }
    }
    commands(&blocks).into_iter().chain(spans).collect()
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
