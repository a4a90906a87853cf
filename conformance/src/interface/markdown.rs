//! The interface for people: `docs/interface.md`.

use super::wiring::readers;
use anhyst_ipc::{ChannelDescription, Interface, NodeId, interface};
use anhyst_launch::external::VARIABLES;
use std::fmt::Write;

/// What no type says: the order of things and what happens when something does not come.
const RULES: &str = include_str!("rules.md");

/// The document.
pub fn markdown() -> String {
    let interface = interface();
    let mut text = String::from(
        "<!-- Generated: `anhyst interface > docs/interface.md`. Change ipc/src/messages.rs or conformance/src/interface/. -->\n# Interface\n\nWhat a program in any language must know to take a node's place in the loop. Written by hand is only [drivers.md](drivers.md), which\nstarts with an example. C header: `anhyst interface --c-header`; Python module: `--python`; everything for a generator of your own: `--json`.\n\n## Channels\n\nOne iceoryx2 publish-subscribe service a channel, one sender each. Every field has eight bytes, little-endian on the machines that iceoryx2\nruns on; no padding. The payload's type name ends in a hash of its field list: after a change of a message old programs are refused,\nnot misread. The user header is empty.\n\n| number | channel | service | type name | bytes | sent by | read by (late: one tick later) |\n|---|---|---|---|---|---|---|\n",
    );
    // Writing to a String cannot fail, here and below.
    for channel in &interface.channels {
        let readers: Vec<String> = readers(channel.name)
            .iter()
            .map(|(node, late)| {
                if *late == 0 {
                    node.to_string()
                } else {
                    format!("{node} (late)")
                }
            })
            .collect();
        let _ = writeln!(
            text,
            "| {} | {} | `{}` | `{}` | {} | {} | {} |",
            channel.number,
            channel.name,
            channel.service,
            channel.type_name,
            channel.size,
            channel.producer,
            readers.join(", ")
        );
    }
    for channel in &interface.channels {
        layout(&mut text, channel);
    }
    services(&mut text, &interface);
    order(&mut text);
    text.push('\n');
    text.push_str(RULES);
    text.push_str("\n## What a driver is told\n\n`anhyst run` sets these for `--external-command` and prints them for `--external`.\n\n| variable | meaning |\n|---|---|\n");
    for (name, about) in VARIABLES {
        let _ = writeln!(text, "| `{name}` | {about} |");
    }
    text
}

fn layout(text: &mut String, channel: &ChannelDescription) {
    let _ = writeln!(
        text,
        "\n### {}\n\n{}\n\n| offset | field | type | unit | meaning |\n|---|---|---|---|---|",
        channel.message, channel.about
    );
    for field in &channel.fields {
        let _ = writeln!(
            text,
            "| {} | `{}` | {} | {} | {} |",
            field.offset, field.name, field.kind, field.unit, field.about
        );
    }
}

fn services(text: &mut String, interface: &Interface) {
    let sizes = &interface.sizes;
    let _ = write!(
        text,
        "\n## Services\n\nAll names lie under the run's prefix and root. Whoever comes first creates a service, so all must create it alike.\n\n| service | pattern | settings |\n|---|---|---|\n| `loop/CHANNEL` | publish-subscribe | safe overflow, `subscriber_max_buffer_size` {}, `subscriber_max_borrowed_samples` {}, `history_size` 0, `max_publishers` {}, `max_subscribers` {}, `max_nodes` {}. A node of the loop subscribes with `buffer_size` {}, the recorder with the largest. A subscriber bears its node's name |\n| `{}` | event | `max_notifiers` {}, `max_listeners` {}, `max_nodes` {}; its process listens, the others ring |\n| `{}` | blackboard, keys and values `u64` | `max_readers` {}, `max_nodes` {}; its process writes, the others read |\n\n",
        sizes.deepest_buffer,
        sizes.max_borrowed,
        sizes.max_publishers,
        sizes.max_subscribers,
        sizes.max_nodes,
        sizes.loop_buffer,
        interface.bell_service,
        sizes.max_notifiers,
        sizes.max_listeners,
        sizes.max_nodes,
        interface.status_service,
        sizes.max_status_readers,
        sizes.max_nodes,
    );
    text.push_str(
        "Processes of ours have a faster bell among themselves, `/dev/shm/PREFIXwake_…` (`ipc/src/shared/wake_word.rs`): one that waits for such a \
         process says asleep 0 in its status. To\ndrivers in other languages it makes no difference.\n\n",
    );
    text.push_str("Entries of a status:\n\n| key | name | meaning |\n|---|---|---|\n");
    for entry in &interface.status {
        let _ = writeln!(text, "| {} | {} | {} |", entry.key, entry.name, entry.about);
    }
}

fn order(text: &mut String) {
    text.push_str("\n## Who sends what when\n\nTick k passes through the nodes in this order. A node waits for its inputs of tick k (late ones: of tick k−1; at tick 0 it takes all\nzeros for them without waiting), computes, and sends its outputs with `tick` = k.\n\n| node | waits for | sends |\n|---|---|---|\n");
    let interface = interface();
    for node in NodeId::LOOP_ORDER {
        let waits: Vec<String> = interface
            .channels
            .iter()
            .filter_map(|channel| {
                let (_, late) = readers(channel.name).into_iter().find(|(reader, _)| *reader == node)?;
                Some(format!("{}({})", channel.name, if late == 0 { "k" } else { "k−1" }))
            })
            .collect();
        let sends: Vec<&str> = interface
            .channels
            .iter()
            .filter(|channel| channel.producer == node.name())
            .map(|channel| channel.name)
            .collect();
        let _ = writeln!(text, "| {node} | {} | {} |", waits.join(", "), sends.join(", "));
    }
}
