//! The loop of `describe --interactive`, with its keys from a pipe.

#[macro_use]
mod world;

use std::io::Write;
use std::process::Stdio;

use world::{Own, number};

/// Types keys; what is shown after each of them.
fn typed(own: &Own, keys: &str, more: &[&str]) -> Vec<String> {
    let mut command = world::program();
    command.arg("describe").arg(own.study()).args(["run_007", "--name", "by-hand", "--interactive"]).args(more);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(keys.as_bytes()).unwrap();
    let outcome = world::Outcome::of(child.wait_with_output().unwrap(), format!("{command:?}")).done();
    // Each screen ends with the line of the keys.
    let screens: Vec<String> = outcome.stdout.split("q quits\n").map(str::to_owned).collect();
    assert_eq!(screens.last().unwrap(), "", "{}", outcome.stdout);
    screens[..screens.len() - 1].to_vec()
}

/// M of a screen.
fn size(screen: &str) -> usize {
    let after = screen.split("M = ").nth(1).unwrap_or_else(|| panic!("no M: {screen}"));
    after.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn keys_raise_and_lower_the_threshold() {
    let own = Own::new();
    let before = own.snapshot();
    let screens = typed(&own, "++\n----q", &[]);
    assert_eq!(screens.len(), 7, "one screen at the start, one a key");
    let sizes: Vec<usize> = screens.iter().map(|screen| size(screen)).collect();
    assert!(sizes[..3].windows(2).all(|pair| pair[1] <= pair[0]), "raising t keeps fewer: {sizes:?}");
    assert!(sizes[2..].windows(2).all(|pair| pair[1] >= pair[0]), "lowering t keeps more: {sizes:?}");
    assert!(sizes[6] > sizes[2], "{sizes:?}");
    for screen in &screens {
        let blocks = screen.chars().filter(|c| "▀▄█".contains(*c)).count();
        assert!(blocks > 50, "a picture: {screen}");
        for row in ["descriptor", "first M", "first 40"] {
            assert!(screen.lines().any(|line| line.trim_start().starts_with(row)), "{row}: {screen}");
        }
        assert!(!screen.contains('\x1b'), "no colours in a pipe");
    }
    world::assert_same(&before, &own.snapshot(), "nothing is saved unasked");
}

#[test]
fn what_is_saved_is_what_is_shown() {
    let own = Own::new();
    let screens = typed(&own, "--s", &[]);
    let m = size(screens.last().unwrap());
    assert!(screens.last().unwrap().contains("saved in"), "{}", screens.last().unwrap());
    let saved = std::fs::read_to_string(own.study().join("descriptors/by-hand.json")).unwrap();
    let saved: serde_json::Value = serde_json::from_str(&saved).unwrap();
    assert_eq!(saved["eigenvectors"].as_array().unwrap().len(), m);
    assert!(saved["rule"].as_str().unwrap().starts_with("value:"), "{}", saved["rule"]);
    assert!(number(&saved["threshold"]) > 0.0);
}

#[test]
fn a_threshold_that_selects_nothing_is_no_end() {
    let own = Own::new();
    let screens = typed(&own, &("+".repeat(60) + "-xq"), &["--select", "difference"]);
    assert!(screens.iter().any(|screen| screen.contains("no coefficient is larger")), "{}", screens.last().unwrap());
    assert!(screens.last().unwrap().contains("no key 'x'"), "{}", screens.last().unwrap());
    assert!(size(screens.last().unwrap()) >= 1);
    // The end of the input is the end of the loop.
    assert_eq!(typed(&own, "", &[]).len(), 1);
    crumple!["describe", own.study(), "run_007", "--interactive", "--json"].refused(&["--json", "--interactive"]);
    crumple!["describe", own.study(), "run_007@9", "--interactive"].refused(&["no @9"]);
}
