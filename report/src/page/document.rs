//! What a page is made of.

use super::bars::{Bars, Shares};
use super::heat::HeatMap;
use crate::chart::Figure;
use crate::table::{Badge, Table, Verdict};

/// A page. Make it with [`Page::new`], add sections, and take [`Page::html`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    pub title: String,
    /// What the page shows, in a sentence or two.
    pub lead: String,
    pub sections: Vec<Section>,
    pub footer: Footer,
}

/// A heading and what stands under it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// For links within the page; made from the heading by [`Section::new`], and unique on the page.
    pub id: String,
    pub heading: String,
    pub badge: Option<Badge>,
    pub blocks: Vec<Block>,
}

/// What a section is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    Paragraph(String),
    List(Vec<String>),
    /// As it is, in letters of one width.
    Code(String),
    Table(Table),
    /// Charts to zoom into.
    Figure {
        figure: Figure,
        caption: String,
    },
    Shares(Shares),
    Bars(Bars),
    Heat(HeatMap),
    /// Two columns with a heading each: what the paper says, what we get.
    Beside {
        left: Note,
        right: Note,
        badge: Option<Badge>,
    },
    Badges(Vec<Badge>),
}

/// A heading and a text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Note {
    pub heading: String,
    pub text: String,
}

/// How the page was made, so that it can be made again.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Footer {
    /// The command line.
    pub command: String,
    /// Name and value, as in the file and the hash of the data.
    pub facts: Vec<(String, String)>,
}

impl Page {
    pub fn new(title: &str, lead: &str) -> Self {
        Page {
            title: title.to_owned(),
            lead: lead.to_owned(),
            ..Page::default()
        }
    }

    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    #[must_use]
    pub fn command(mut self, command: &str) -> Self {
        command.clone_into(&mut self.footer.command);
        self
    }

    /// Every chart of its figures, as one figure.
    pub fn charts(&self) -> Figure {
        let blocks = self.sections.iter().flat_map(|section| &section.blocks);
        let charts = blocks.filter_map(|block| match block {
            Block::Figure { figure, .. } => Some(figure.charts.iter().cloned()),
            _ => None,
        });
        Figure::new(&self.title, charts.flatten().collect())
    }

    /// A line of the footer.
    #[must_use]
    pub fn fact(mut self, name: &str, value: &str) -> Self {
        self.footer.facts.push((name.to_owned(), value.to_owned()));
        self
    }
}

impl Section {
    pub fn new(heading: &str) -> Self {
        Section {
            id: slug(heading),
            heading: heading.to_owned(),
            ..Section::default()
        }
    }

    #[must_use]
    pub fn badge(mut self, verdict: Verdict, text: &str) -> Self {
        self.badge = Some(Badge::new(verdict, text));
        self
    }

    #[must_use]
    pub fn block(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    #[must_use]
    pub fn paragraph(self, text: &str) -> Self {
        self.block(Block::Paragraph(text.to_owned()))
    }

    #[must_use]
    pub fn table(self, table: Table) -> Self {
        self.block(Block::Table(table))
    }

    #[must_use]
    pub fn figure(self, figure: Figure, caption: &str) -> Self {
        let caption = caption.to_owned();
        self.block(Block::Figure { figure, caption })
    }

    /// Two texts side by side under their headings.
    #[must_use]
    pub fn beside(self, left: (&str, &str), right: (&str, &str), badge: Option<Badge>) -> Self {
        let note = |(heading, text): (&str, &str)| Note {
            heading: heading.to_owned(),
            text: text.to_owned(),
        };
        let (left, right) = (note(left), note(right));
        self.block(Block::Beside { left, right, badge })
    }
}

/// A heading as an id: "What is left?" becomes "what-is-left".
pub(super) fn slug(heading: &str) -> String {
    let lower = heading.to_lowercase();
    let words: Vec<&str> = lower
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    if words.is_empty() {
        "section".to_owned()
    } else {
        words.join("-")
    }
}
