//! Which processes of a scenario somebody else starts.

use super::{Placement, Scenario};
use anhyst_ipc::{Invalid, NodeId, fingerprint};

impl Scenario {
    /// The processes that the launcher does not start: those with an external node.
    pub fn external_processes(&self) -> Vec<String> {
        let external = |nodes: &[NodeId]| nodes.iter().any(|node| self.external.contains(node));
        let processes = self.placement.processes().into_iter();
        processes
            .filter(|(_, nodes)| external(nodes))
            .map(|(name, _)| name)
            .collect()
    }

    /// The nodes of those processes: all that share a process with an external node.
    pub fn external_nodes(&self) -> Vec<NodeId> {
        let names = self.external_processes();
        let processes = self.placement.processes().into_iter();
        processes
            .filter(|(name, _)| names.contains(name))
            .flat_map(|(_, nodes)| nodes)
            .collect()
    }

    /// Checks that what is external can be.
    ///
    /// # Errors
    /// The recorder, or any node of an embedded run.
    pub fn validate_external(&self) -> Result<(), Invalid> {
        if self.external.is_empty() {
            return Ok(());
        }
        if self.placement == Placement::Embedded {
            let sentence =
                "an embedded run has one process and no links for an external one: use placement Separate or Groups";
            return Err(Invalid::new("external", sentence.to_owned()));
        }
        if self.external_nodes().contains(&NodeId::Recorder) {
            let sentence =
                "the recorder judges the run and cannot be external, nor share a process with a node that is";
            return Err(Invalid::new("external", sentence.to_owned()));
        }
        Ok(())
    }

    /// Fingerprint of what all processes must have been told alike. Who starts a process is not part of it.
    ///
    /// # Errors
    /// If the scenario has no RON form.
    pub fn agreement(&self) -> Result<u64, ron::Error> {
        let told = Scenario {
            external: Vec::new(),
            // A process that takes another one's place has read those that came meanwhile.
            changes: Vec::new(),
            ..self.clone()
        };
        told.to_ron().map(|text| fingerprint(&text))
    }
}
