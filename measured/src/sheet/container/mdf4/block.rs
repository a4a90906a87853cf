//! Blocks: four letters, a length, links, data.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

use super::super::Reason;
use super::super::numbers::Cursor;

/// Blocks that are followed in one file.
const MOST_BLOCKS: usize = 1_000_000;

/// A file's blocks.
pub(super) struct Blocks<'a> {
    bytes: &'a [u8],
    /// Followed so far; a chain that comes back to itself would never end.
    followed: Cell<usize>,
    groups: RefCell<BTreeSet<u64>>,
}

/// One of them.
pub(super) struct Block<'a> {
    pub id: [u8; 4],
    pub at: u64,
    links: Vec<u64>,
    data: &'a [u8],
}

impl Block<'_> {
    /// Where another block stands; 0 where there is none.
    pub fn link(&self, index: usize) -> u64 {
        self.links.get(index).copied().unwrap_or(0)
    }

    pub fn links(&self) -> &[u64] {
        &self.links
    }
}

impl<'a> Block<'a> {
    pub fn data(&self) -> Cursor<'a> {
        Cursor::new(self.data)
    }

    pub fn bytes(&self) -> &'a [u8] {
        self.data
    }
}

impl<'a> Blocks<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Blocks {
            bytes,
            followed: Cell::new(0),
            groups: RefCell::default(),
        }
    }

    /// Channel chains that were followed so far.
    pub fn counted(&self) -> usize {
        self.groups.borrow().len()
    }

    /// The block at a place, whatever it is.
    pub fn any(&self, at: u64) -> Result<Block<'a>, Reason> {
        self.followed.set(self.followed.get() + 1);
        if self.followed.get() > MOST_BLOCKS {
            return Err(format!(
                "more than {MOST_BLOCKS} blocks are pointed to: its blocks point in circles"
            ));
        }
        let mut cursor = Cursor::new(self.bytes).from(at)?;
        let mut id = [0; 4];
        id.copy_from_slice(cursor.take(4)?);
        cursor.take(4)?;
        let (length, links) = (cursor.u64()?, cursor.u64()?);
        let links_bytes = links
            .checked_mul(8)
            .ok_or("a block has more links than a file can hold")?;
        let data = length.checked_sub(24).and_then(|rest| rest.checked_sub(links_bytes));
        let data = data.ok_or_else(|| format!("the block at byte {at} is shorter than its links"))?;
        let links = cursor.take(links_bytes)?.chunks_exact(8);
        let links = links.map(|link| link.iter().rev().fold(0, |sum: u64, byte| sum << 8 | u64::from(*byte)));
        Ok(Block {
            id,
            at,
            links: links.collect(),
            data: cursor.take(data)?,
        })
    }

    /// The block at a place, which must be of a kind.
    pub fn at(&self, at: u64, id: &[u8; 4]) -> Result<Block<'a>, Reason> {
        let block = self.any(at)?;
        if block.id == *id {
            return Ok(block);
        }
        let name = |id: &[u8; 4]| String::from_utf8_lossy(id).into_owned();
        Err(format!(
            "at byte {at} stands a block {} where {} is announced",
            name(&block.id),
            name(id)
        ))
    }

    /// A block and those that follow it by their first link.
    pub fn chain(&self, mut at: u64, id: &[u8; 4]) -> Result<Vec<Block<'a>>, Reason> {
        if id == b"##CN" {
            self.groups.borrow_mut().insert(at);
        }
        let mut blocks: Vec<Block> = Vec::new();
        let mut seen = BTreeSet::new();
        while at != 0 {
            if !seen.insert(at) {
                return Err(format!("the blocks from byte {at} on point in a circle"));
            }
            let block = self.at(at, id)?;
            at = block.link(0);
            blocks.push(block);
        }
        Ok(blocks)
    }

    /// Text, plain or as XML, in which `<TX>` holds it.
    pub fn text(&self, at: u64) -> Result<Option<String>, Reason> {
        if at == 0 {
            return Ok(None);
        }
        let block = self.any(at)?;
        let text = String::from_utf8_lossy(block.data);
        let text = text.trim_end_matches('\0');
        match &block.id {
            b"##TX" => Ok(Some(text.trim().to_owned())),
            b"##MD" => {
                let inner = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
                Ok(inner.map(|(inner, _)| inner.trim().to_owned()))
            }
            _ => Err(format!("at byte {at} stands no text where one is announced")),
        }
    }
}
