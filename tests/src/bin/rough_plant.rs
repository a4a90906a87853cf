//! A rig as it is, as somebody else's process: the witness with constants, effects and sensors drawn from a seed, which shares no
//! code with the model that the loop believes in. `rough_plant SEED`, or `rough_plant nominal` for the plant that is believed in; behind it
//! so many times the displacement in what its sensor says (`sensor=-1`), so many times the field in its coil that is asked for (`coil=-1`).

use anhyst_ipc::{
    Block, Channel, CoilField, ExternalClock, ExternalNode, ExternalSettings, MAX_WORDS, Message, Previous, Received,
};
use anhyst_tests::{Witness, rough};
use std::env::{args, var};
use std::error::Error;
use std::time::Duration;

/// For the others to appear, and for each token.
const LIMIT: Duration = Duration::from_secs(60);

fn main() {
    if let Err(error) = run() {
        eprintln!("plant: {error}");
        std::process::exit(4);
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let plant = match args().nth(1).ok_or("which seed?")?.as_str() {
        "nominal" => rough::nominal(0),
        seed => rough::rough(seed.parse()?),
    };
    let factor = |name: &str| -> Result<f64, Box<dyn Error>> {
        let own = args().skip(2).find_map(|own| own.strip_prefix(name).map(str::to_owned));
        Ok(own.map_or(Ok(1.0), |own| own.parse())?)
    };
    let factors = [factor("sensor=")?, factor("coil=")?];
    let settings = ExternalSettings {
        process: var("ANHYST_PROCESS")?,
        prefix: var("ANHYST_SERVICE_PREFIX")?,
        root: var("ANHYST_ROOT")?.into(),
        processes: var("ANHYST_PROCESSES").ok(),
        reads: vec![Channel::CoilField],
        yields: 20,
        start_limit: LIMIT,
    };
    let mut node = ExternalNode::open(settings, ExternalClock::Lockstep)?;
    cut(&mut node, plant, factors, var("ANHYST_TICKS")?.parse()?)?;
    Ok(node.close()?)
}

fn cut(
    node: &mut ExternalNode,
    mut plant: Witness,
    [sensor, amplifier]: [f64; 2],
    ticks: u64,
) -> Result<(), Box<dyn Error>> {
    let mut words = [0; MAX_WORDS];
    let mut coil = CoilField::default();
    for tick in 0..ticks {
        let (mut measurement, truth) = plant.step(tick, (Previous(coil),));
        measurement.displacement_m *= sensor;
        say(node, tick, &measurement)?;
        say(node, tick, &truth)?;
        coil = match node.receive(Channel::CoilField, LIMIT, &mut words)? {
            Received::Token(tick) => {
                let own = CoilField::from_words(tick, &words[2..]);
                let field_a_per_m = amplifier * own.field_a_per_m;
                CoilField { field_a_per_m, ..own }
            }
            Received::Silence => return Err(format!("no coil field for {LIMIT:?} after tick {tick}").into()),
            Received::End => return Ok(()),
        };
    }
    // The amplifier's last word has been heard: what comes now is the end.
    node.receive(Channel::CoilField, LIMIT, &mut words)?;
    Ok(())
}

fn say<M: Message>(node: &mut ExternalNode, tick: u64, message: &M) -> Result<(), Box<dyn Error>> {
    let mut words = [0; MAX_WORDS];
    words[0] = tick;
    message.write_words(&mut words[2..]);
    Ok(node.send(M::CHANNEL, &words)?)
}
