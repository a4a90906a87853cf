//! A run that is split over two hosts: what a command must be told of it, and the bridge's arguments.

use anhyst_ipc::NodeId;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Which part of the run is on this host, and where the other part is.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct AcrossArguments {
    /// The nodes of this host, the others run on the other one: `--here plant-sim,amplifier`.
    #[arg(long, value_delimiter = ',', value_name = "NODE,…", value_parser = one_of(&NodeId::LOOP_ORDER))]
    pub here: Vec<NodeId>,
    /// Wait for the other host's bridge at this Zenoh endpoint: `tcp/10.0.0.1:7447`.
    #[arg(long, value_name = "ENDPOINT", requires = "here", conflicts_with = "connect", value_parser = endpoint)]
    pub listen: Option<String>,
    /// Go to the other host's bridge, which listens at this endpoint.
    #[arg(long, value_name = "ENDPOINT", requires = "here", value_parser = endpoint)]
    pub connect: Option<String>,
    /// The longest round trip between the bridges, which 99 of 100 must keep (default: the receive limit of the scenario).
    #[arg(long, value_name = "MICROSECONDS", requires = "here")]
    pub budget_us: Option<f64>,
    /// Name of the run in the keys `anhyst/RUN/CHANNEL`; the same on both hosts.
    #[arg(long, value_name = "RUN", default_value = "run", requires = "here")]
    pub run_name: String,
}

/// Where Zenoh listens or goes.
///
/// # Errors
/// If it is no `PROTOCOL/ADDRESS`; of TCP the address ends in a port.
pub fn endpoint(text: &str) -> Result<String, String> {
    let is_endpoint = text.split_once('/').is_some_and(|(protocol, address)| {
        let port = address
            .rsplit_once(':')
            .map(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
        !protocol.is_empty() && !address.is_empty() && (protocol != "tcp" || port == Some(true))
    });
    is_endpoint
        .then(|| text.to_owned())
        .ok_or_else(|| "no endpoint of Zenoh: write tcp/HOST:PORT".into())
}

/// The name of the bridge's process: its report, its log, its place in sentences.
pub const BRIDGE: &str = "bridge";

/// One of `nodes`, by its name; another name is refused with those that there are.
pub fn one_of(nodes: &[NodeId]) -> impl TypedValueParser<Value = NodeId> + use<> {
    let names: Vec<&'static str> = nodes.iter().map(|node| node.name()).collect();
    PossibleValuesParser::new(names).try_map(|name| NodeId::named(&name).ok_or("no node has this name"))
}

impl AcrossArguments {
    /// True if only a part of the run is here.
    pub fn is_part(&self) -> bool {
        !self.here.is_empty()
    }

    /// Checks what clap cannot.
    ///
    /// # Errors
    /// A sentence.
    pub fn validate(&self) -> Result<(), String> {
        if self.is_part() && self.listen.is_none() && self.connect.is_none() {
            return Err(
                "--here names a part of the run: say with --listen or --connect where the other part is".into(),
            );
        }
        if let Some(budget_us) = self.budget_us.filter(|budget_us| !(1.0..=1e9).contains(budget_us)) {
            return Err(format!("--budget-us {budget_us} is outside [1, 1e9] µs"));
        }
        let known = |character: char| character.is_ascii_alphanumeric() || character == '-' || character == '_';
        if self.run_name.is_empty() || !self.run_name.chars().all(known) {
            let name = &self.run_name;
            return Err(format!("--run-name {name:?} may have letters, digits, - and _ only"));
        }
        Ok(())
    }

    /// True if the process with these nodes is of this host. One that is here in part is the bridge's to refuse.
    pub fn starts(&self, nodes: &[NodeId]) -> bool {
        !self.is_part() || nodes.iter().any(|node| self.here.contains(node))
    }

    /// The same as words of a command line.
    pub fn to_words(&self) -> Vec<String> {
        let here: Vec<&str> = self.here.iter().map(|node| node.name()).collect();
        let mut words = vec![
            "--here".into(),
            here.join(","),
            "--run-name".into(),
            self.run_name.clone(),
        ];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.into_iter().flat_map(|value| [name.to_owned(), value]));
        };
        option("--listen", self.listen.clone());
        option("--connect", self.connect.clone());
        option("--budget-us", self.budget_us.map(|budget_us| budget_us.to_string()));
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        across: AcrossArguments,
    }

    // Guards that a launcher hands its bridge what the user told it.
    #[test]
    fn words_come_back() {
        let line = [
            "x",
            "--here",
            "plant-sim,amplifier",
            "--listen",
            "tcp/[::1]:7447",
            "--budget-us",
            "250.5",
        ];
        let across = Line::try_parse_from(line).unwrap().across;
        across.validate().unwrap();
        let words = across.to_words();
        let again = Line::try_parse_from(std::iter::once("x".to_owned()).chain(words))
            .unwrap()
            .across;
        assert_eq!(format!("{across:?}"), format!("{again:?}"));
        assert!(across.starts(&[NodeId::Amplifier]) && !across.starts(&[NodeId::Guard]));
    }

    // Guards that half an answer is refused: a part without a way to the rest, a way without a part, a wrong name.
    #[test]
    fn incomplete_arguments_are_refused() {
        for line in [
            &["x", "--listen", "tcp/a:1"][..],
            &[
                "x",
                "--here",
                "plant-sim",
                "--listen",
                "tcp/a:1",
                "--connect",
                "tcp/b:1",
            ],
            &["x", "--here", "plant_sim"],
            &["x", "--here", "guard", "--listen", "nonsense"],
            &["x", "--here", "guard", "--listen", "tcp/a"],
            &["x", "--here", "guard", "--connect", "tcp/a:70000"],
        ] {
            assert!(Line::try_parse_from(line).is_err(), "{line:?}");
        }
        for line in [
            &["x", "--here", "guard"][..],
            &["x", "--here", "guard", "--listen", "tcp/a:1", "--budget-us", "0"],
            &["x", "--here", "guard", "--listen", "tcp/a:1", "--run-name", "a/b"],
        ] {
            assert!(
                Line::try_parse_from(line).unwrap().across.validate().is_err(),
                "{line:?}"
            );
        }
        assert!(Line::try_parse_from(["x"]).unwrap().across.starts(&[NodeId::Guard]));
    }
}
