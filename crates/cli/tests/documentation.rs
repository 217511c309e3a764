//! `docs/cli.md` is the program's reference: every option that it names exists, and every option is named.

use clap::CommandFactory;
use orthant::args::Cli;
use std::collections::BTreeSet;

/// The text of docs/cli.md by heading of the second level.
fn sections() -> Vec<(String, String)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/cli.md");
    let text = std::fs::read_to_string(path).expect("docs/cli.md");
    text.split("\n## ")
        .skip(1)
        .map(|s| s.split_once('\n').expect("a heading has a text"))
        .map(|(heading, text)| (heading.trim().to_owned(), text.to_owned()))
        .collect()
}

/// Every `--option` in code spans and indented code of a text.
fn options_in(text: &str) -> BTreeSet<String> {
    let mut options = BTreeSet::new();
    for span in text.split('`').skip(1).step_by(2) {
        let words = span.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
        options.extend(words.filter_map(|w| w.strip_prefix("--")).filter(|w| !w.is_empty()).map(str::to_owned));
    }
    options
}

/// Long options of a command and of the commands below it.
fn options_of(command: &clap::Command, global: bool) -> BTreeSet<String> {
    let long = command.get_arguments().filter(|a| a.is_global_set() == global).filter_map(|a| a.get_long());
    let below = command.get_subcommands().filter(|c| c.get_name() != "help").flat_map(|c| options_of(c, global));
    long.map(str::to_owned).chain(below).collect()
}

#[test]
fn every_option_is_documented_and_every_documented_option_exists() {
    let mut cli = Cli::command();
    cli.build();
    let sections = sections();
    let section = |name: &str| &sections.iter().find(|(h, _)| h == name).unwrap_or_else(|| panic!("no ## {name}")).1;
    let global = options_of(&cli, true);
    let common: BTreeSet<String> = options_in(section("Options of every command"));
    let built_in: BTreeSet<String> = ["help", "version"].map(String::from).into();
    assert_eq!(common, global.union(&built_in).cloned().collect());

    let all: BTreeSet<String> = cli.get_subcommands().flat_map(|c| options_of(c, false)).collect();
    for command in cli.get_subcommands().filter(|c| c.get_name() != "help") {
        let name = command.get_name();
        let mut defined = options_of(command, false);
        defined.remove("help");
        let documented = options_in(section(name));
        let missing: Vec<_> = defined.difference(&documented).collect();
        assert!(missing.is_empty(), "docs/cli.md, {name}: not documented: {missing:?}");
        let unknown: Vec<_> = documented.difference(&defined).filter(|o| !all.contains(*o)).collect();
        assert!(unknown.is_empty(), "docs/cli.md, {name}: no such option: {unknown:?}");
    }
    for (heading, _) in &sections {
        let known = cli.find_subcommand(heading).is_some() || heading == "Options of every command";
        assert!(known, "docs/cli.md describes {heading:?}, which is no command");
    }
}

#[test]
fn defaults_in_the_documentation_are_those_of_the_program() {
    let mut cli = Cli::command();
    cli.build();
    let sections = sections();
    let mut checked = 0;
    for command in cli.get_subcommands() {
        let Some((_, text)) = sections.iter().find(|(h, _)| h == command.get_name()) else { continue };
        for argument in command.get_arguments() {
            let Some(long) = argument.get_long() else { continue };
            // Lines such as: * `--spp N` (64): samples per pixel.
            let line = text.lines().find(|l| l.starts_with(&format!("* `--{long} ")));
            let Some((_, rest)) = line.and_then(|l| l.split_once("` (")) else { continue };
            let documented = rest.split(')').next().unwrap_or_default();
            let defaults: Vec<_> = argument.get_default_values().iter().map(|v| v.to_string_lossy()).collect();
            assert_eq!(defaults, [documented], "--{long}");
            checked += 1;
        }
    }
    assert!(checked >= 12, "only {checked} defaults were found");
}
