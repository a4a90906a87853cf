//! From a page to its text.

use super::document::{Block, Footer, Note, Page, Section, slug};
use super::escaped::{Plain, Prose};
use super::{bars, heat, interactive};
use crate::chart::Figure;
use crate::table::{Badge, Cell, Table, Verdict};

const STYLE: &str = include_str!("style.css");
/// A page with this many sections opens with links to them.
const SECTIONS_WITH_LINKS: usize = 3;

/// The sections' ids, with a number where one was there before.
fn ids(sections: &[Section]) -> Vec<String> {
    let mut ids: Vec<String> = Vec::new();
    for section in sections {
        let wanted = slug(&section.id);
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let free = std::iter::once(wanted.clone())
            .chain(numbered)
            .find(|id| !ids.contains(id));
        ids.push(free.unwrap_or(wanted));
    }
    ids
}

impl Page {
    /// The page as text, to be written to one file.
    pub fn html(&self) -> String {
        let ids = ids(&self.sections);
        let sections: String = self.sections.iter().zip(&ids).map(|(of, id)| section(of, id)).collect();
        let title = Plain(&self.title);
        let scripts = scripts(self);
        let lead = if self.lead.is_empty() {
            String::new()
        } else {
            format!("<p class=\"lead\">{}</p>\n", Prose(&self.lead))
        };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n\
         <header>\n<h1>{title}</h1>\n{lead}</header>\n{}{sections}{}</main>\n{scripts}</body>\n</html>\n",
            if scripts.is_empty() {
                ""
            } else {
                interactive::LIBRARY_STYLE
            },
            links(self, &ids),
            footer(&self.footer)
        )
    }
}

/// What draws the charts, after their data; nothing for a page without any.
fn scripts(page: &Page) -> String {
    let mut blocks = page.sections.iter().flat_map(|section| &section.blocks);
    if !blocks.any(|block| matches!(block, Block::Figure { .. })) {
        return String::new();
    }
    // Scripts hold signs that mean something else in XML.
    let script = |text: &str| format!("<script>/*<![CDATA[*/\n{text}\n/*]]>*/</script>\n");
    format!(
        "<!-- uPlot, which draws the charts:\n{}\n-->\n{}<noscript><p>The charts need JavaScript; nothing is fetched.</p></noscript>\n",
        interactive::LIBRARY_LICENSE,
        interactive::SCRIPTS.map(script).concat()
    )
}

fn links(page: &Page, ids: &[String]) -> String {
    if page.sections.len() < SECTIONS_WITH_LINKS {
        return String::new();
    }
    let link = |(section, id): (&Section, &String)| {
        let mark = section
            .badge
            .as_ref()
            .map_or(String::new(), |of| format!(" {}", badge(of)));
        format!(
            "<li><a href=\"#{}\">{}</a>{mark}</li>\n",
            Plain(id),
            Prose(&section.heading)
        )
    };
    let items: String = page.sections.iter().zip(ids).map(link).collect();
    format!("<nav aria-label=\"Contents\">\n<ol>\n{items}</ol>\n</nav>\n")
}

fn section(section: &Section, id: &str) -> String {
    let mark = section
        .badge
        .as_ref()
        .map_or(String::new(), |of| format!(" {}", badge(of)));
    let blocks: String = section.blocks.iter().map(block).collect();
    let (id, heading) = (Plain(id), Prose(&section.heading));
    format!("<section id=\"{id}\">\n<h2>{heading}{mark}</h2>\n{blocks}</section>\n")
}

fn block(block: &Block) -> String {
    match block {
        Block::Paragraph(text) => format!("<p>{}</p>\n", Prose(text)),
        Block::List(items) => {
            let items: String = items.iter().map(|item| format!("<li>{}</li>\n", Prose(item))).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Block::Code(text) => format!("<pre><code>{}</code></pre>\n", Plain(text)),
        Block::Table(of) => table(of),
        Block::Figure { figure: of, caption } => figure(of, caption),
        Block::Shares(of) => bars::shares(of),
        Block::Bars(of) => bars::bars(of),
        Block::Heat(of) => heat::heat_map(of),
        Block::Beside { left, right, badge: of } => {
            let mark = of
                .as_ref()
                .map_or(String::new(), |of| format!("<p class=\"verdict\">{}</p>\n", badge(of)));
            format!("<div class=\"beside\">\n{}{}{mark}</div>\n", note(left), note(right))
        }
        Block::Badges(all) => {
            let all: Vec<String> = all.iter().map(badge).collect();
            format!("<p class=\"badges\">{}</p>\n", all.join(" "))
        }
    }
}

fn note(note: &Note) -> String {
    format!(
        "<div>\n<h3>{}</h3>\n<p>{}</p>\n</div>\n",
        Prose(&note.heading),
        Prose(&note.text)
    )
}

fn badge(badge: &Badge) -> String {
    // A colour alone says nothing to some readers and on paper.
    let (class, sign) = match badge.verdict {
        Verdict::Pass => ("pass", "✓ "),
        Verdict::Fail => ("fail", "✗ "),
        Verdict::Note => ("note", ""),
    };
    format!("<span class=\"badge {class}\">{sign}{}</span>", Plain(&badge.text))
}

fn figure(figure: &Figure, caption: &str) -> String {
    let title = match figure.title.as_str() {
        "" => String::new(),
        title => format!("<h3>{}</h3>\n", Plain(title)),
    };
    format!(
        "<figure>\n{title}{}<figcaption>{}</figcaption>\n</figure>\n",
        interactive::charts(figure),
        Prose(caption)
    )
}

fn table(table: &Table) -> String {
    let class = |numeric: bool| if numeric { " class=\"number\"" } else { "" };
    let header = table.header.iter().enumerate();
    let header: String = header
        .map(|(column, name)| {
            format!(
                "<th scope=\"col\"{}>{}</th>",
                class(table.is_numeric(column)),
                Prose(name)
            )
        })
        .collect();
    let cell = |cell: &Cell| match cell {
        Cell::Words(text) => format!("<td>{}</td>", Prose(text)),
        Cell::Number(text) => format!("<td{}>{}</td>", class(true), Plain(text)),
        Cell::Badge(of) => format!("<td>{}</td>", badge(of)),
    };
    let row = |row: &Vec<Cell>| {
        let missing = "<td></td>".repeat(table.header.len().saturating_sub(row.len()));
        format!("<tr>{}{missing}</tr>\n", row.iter().map(cell).collect::<String>())
    };
    let rows: String = table.rows.iter().map(row).collect();
    let caption = match table.caption.as_str() {
        "" => String::new(),
        caption => format!("<caption>{}</caption>\n", Prose(caption)),
    };
    format!(
        "<div class=\"wide\">\n<table>\n{caption}<thead>\n<tr>{header}</tr>\n</thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n"
    )
}

fn footer(footer: &Footer) -> String {
    let command = match footer.command.as_str() {
        "" => String::new(),
        command => format!("<dt>command</dt>\n<dd><code>{}</code></dd>\n", Plain(command)),
    };
    let fact = |(name, value): &(String, String)| format!("<dt>{}</dt>\n<dd>{}</dd>\n", Plain(name), Prose(value));
    let facts: String = footer.facts.iter().map(fact).collect();
    if command.is_empty() && facts.is_empty() {
        return String::new();
    }
    format!("<footer>\n<dl>\n{command}{facts}</dl>\n</footer>\n")
}
