//! The text of a RON file, with the place of every value in it: so that a refused setting can be shown where it stands,
//! and `--set path=value` can edit it before it is read.
//!
//! A path is a list of field names and list positions, `plant.sensors.displacement_noise_m` or `expect.limits.0`; names of
//! enum variants are not part of it. Only the structure is read here; what values mean is serde's affair.

use std::ops::Range;

/// A value's place: byte ranges into the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The value itself.
    pub value: Range<usize>,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Kind {
    Scalar,
    /// Named fields, or map entries with string keys; `end` is the closing bracket.
    Struct {
        fields: Vec<(String, Place)>,
        end: usize,
    },
    /// Positions of a list, tuple or newtype.
    List(Vec<Place>),
}

/// Reads the structure of `text`; `None` if it is no RON (serde's own error is then the better one).
pub fn read(text: &str) -> Option<Place> {
    let mut scanner = Scanner {
        bytes: text.as_bytes(),
        at: 0,
        depth: 0,
    };
    scanner.skip_attributes();
    scanner.value()
}

/// The texts of the values in a list, `[1.0, (a: 2)]`; `None` if it is none.
pub fn items(text: &str) -> Option<Vec<&str>> {
    let place = read(text)?;
    let whole = place.value.start == 0 && place.value.end == text.len() && text.starts_with('[');
    match place.kind {
        Kind::List(items) if whole => Some(items.iter().map(|item| &text[item.value.clone()]).collect()),
        _ => None,
    }
}

impl Place {
    /// The value at `path`, or the innermost value on the way to it that exists.
    pub fn nearest(&self, path: &str) -> &Place {
        let mut place = self;
        for segment in path.split('.').filter(|segment| !segment.is_empty()) {
            match place.child(segment) {
                Some(child) => place = child,
                None => break,
            }
        }
        place
    }

    /// True if there is a value at `path`.
    pub fn has(&self, path: &str) -> bool {
        let mut place = Some(self);
        for segment in path.split('.') {
            place = place.and_then(|place| place.child(segment));
        }
        place.is_some()
    }

    /// The path of the innermost value at a byte: names, and numbers in lists, joined by dots.
    pub fn path_at(&self, byte: usize) -> String {
        let mut path = Vec::new();
        let mut place = self;
        while let Some((name, inner)) = place
            .children()
            .into_iter()
            .find(|(_, inner)| (inner.value.start..=inner.value.end).contains(&byte))
        {
            path.extend(name);
            place = inner;
        }
        path.join(".")
    }

    /// Values one deeper, with their names; a variant's or newtype's only value has none.
    fn children(&self) -> Vec<(Option<String>, &Place)> {
        match &self.kind {
            Kind::Scalar => Vec::new(),
            Kind::Struct { fields, .. } => fields.iter().map(|(name, place)| (Some(name.clone()), place)).collect(),
            Kind::List(items) if items.len() == 1 && matches!(items[0].kind, Kind::Struct { .. }) => {
                vec![(None, &items[0])]
            }
            Kind::List(items) => {
                let numbered = items.iter().enumerate();
                numbered.map(|(at, place)| (Some(at.to_string()), place)).collect()
            }
        }
    }

    /// True if the value has, or may have, fields.
    pub fn has_fields(&self) -> bool {
        matches!(self.kind, Kind::Struct { .. })
    }

    /// True if the value is a struct with a field of this name.
    pub fn has_field(&self, name: &str) -> bool {
        matches!(&self.kind, Kind::Struct { fields, .. } if fields.iter().any(|(field, _)| field == name))
    }

    fn child(&self, segment: &str) -> Option<&Place> {
        match &self.kind {
            Kind::Scalar => None,
            Kind::Struct { fields, .. } => fields.iter().find(|(name, _)| name == segment).map(|(_, place)| place),
            Kind::List(items) => match segment.parse::<usize>() {
                Ok(index) => items.get(index),
                // A newtype around a struct is transparent: `Some((a: 1))`.
                Err(_) => items.first().filter(|_| items.len() == 1)?.child(segment),
            },
        }
    }

    /// `text` with `path` set to `value`: replaced where it stands, added where it does not, with the structs on the way to it.
    /// Whether the names mean anything is serde's affair.
    ///
    /// # Errors
    /// A sentence, if something on the way has no named fields.
    pub fn set(&self, text: &str, path: &str, value: &str) -> Result<String, String> {
        let mut place = self;
        let segments: Vec<&str> = path.split('.').collect();
        for (i, segment) in segments.iter().enumerate() {
            match place.child(segment) {
                Some(child) => place = child,
                None => {
                    let nested = |inner: String, name: &&str| format!("({name}: {inner})");
                    let value = segments[i + 1..].iter().rev().fold(value.to_owned(), nested);
                    return place.insert(text, segment, &value, path);
                }
            }
        }
        Ok(format!(
            "{}{value}{}",
            &text[..place.value.start],
            &text[place.value.end..]
        ))
    }

    fn insert(&self, text: &str, name: &str, value: &str, path: &str) -> Result<String, String> {
        let (fields, end) = match &self.kind {
            Kind::Struct { fields, end } => (fields, *end),
            Kind::List(items) if items.len() == 1 => return items[0].insert(text, name, value, path),
            _ if text[..self.value.start].trim_end().ends_with("File(") => {
                let (file, holder) = (&text[self.value.clone()], path.split('.').next().unwrap_or_default());
                return Err(format!(
                    "it stands in the file {file}; edit that, or set all of it, as in --set '{holder}=File(\"FILE\")' or \
                     '{holder}=Inline(…)'"
                ));
            }
            _ => return Err("what holds it has no named fields".to_owned()),
        };
        let after_last = fields.last().map(|(_, place)| place.value.end);
        let comma = after_last.is_some_and(|last| !text[last..end].trim_start().starts_with(','));
        let at = after_last.filter(|_| comma).unwrap_or(end);
        let before = if comma { ", " } else { "" };
        Ok(format!("{}{before}{name}: {value}{}", &text[..at], &text[at..]))
    }
}

/// Line and column (both from 1) of a byte.
pub fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text[..byte.min(text.len())];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    (line, column)
}

struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Brackets that are open.
    depth: usize,
}

/// Deeper than any scenario, and as deep as serde's reader goes: a file of nothing but brackets must not exhaust the stack.
const DEEPEST: usize = 128;

impl Scanner<'_> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn starts(&self, text: &str) -> bool {
        // A torn text may have been left behind its end.
        self.bytes
            .get(self.at..)
            .is_some_and(|rest| rest.starts_with(text.as_bytes()))
    }

    fn skip_blank(&mut self) {
        loop {
            if self.starts("//") {
                while self.peek().is_some_and(|b| b != b'\n') {
                    self.at += 1;
                }
            } else if self.starts("/*") {
                let rest = &self.bytes[self.at..];
                self.at += rest
                    .windows(2)
                    .position(|pair| pair == b"*/")
                    .map_or(rest.len(), |end| end + 2);
            } else if self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
                self.at += 1;
            } else {
                return;
            }
        }
    }

    fn skip_attributes(&mut self) {
        self.skip_blank();
        while self.starts("#!") {
            while self.peek().is_some_and(|b| b != b']') {
                self.at += 1;
            }
            self.at += 1;
            self.skip_blank();
        }
    }

    fn value(&mut self) -> Option<Place> {
        self.skip_blank();
        let start = self.at;
        let kind = match self.peek()? {
            b'(' => self.bracketed(b')')?,
            b'{' => self.bracketed(b'}')?,
            b'[' => self.bracketed(b']')?,
            b'"' => self.string()?,
            _ => {
                self.word()?;
                let after_word = self.at;
                self.skip_blank();
                if self.peek() == Some(b'(') {
                    self.bracketed(b')')?
                } else {
                    self.at = after_word;
                    Kind::Scalar
                }
            }
        };
        Some(Place {
            value: start..self.at,
            kind,
        })
    }

    fn word(&mut self) -> Option<String> {
        let start = self.at;
        while self
            .peek()
            .is_some_and(|b| b.is_ascii_alphanumeric() || b"_+-.#'".contains(&b))
        {
            self.at += 1;
        }
        (self.at > start).then(|| String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned())
    }

    fn string(&mut self) -> Option<Kind> {
        self.at += 1;
        while let Some(byte) = self.peek() {
            self.at += if byte == b'\\' { 2 } else { 1 };
            if byte == b'"' {
                return Some(Kind::Scalar);
            }
        }
        None
    }

    /// What stands between brackets: named fields, map entries, or positions.
    fn bracketed(&mut self, close: u8) -> Option<Kind> {
        if self.depth == DEEPEST {
            return None;
        }
        self.depth += 1;
        let kind = self.between_brackets(close);
        self.depth -= 1;
        kind
    }

    fn between_brackets(&mut self, close: u8) -> Option<Kind> {
        self.at += 1;
        let mut fields = Vec::new();
        let mut items = Vec::new();
        loop {
            self.skip_blank();
            if self.peek()? == close {
                let end = self.at;
                self.at += 1;
                let named = !fields.is_empty() || (items.is_empty() && close != b']');
                return Some(if named {
                    Kind::Struct { fields, end }
                } else {
                    Kind::List(items)
                });
            }
            let first = self.value()?;
            self.skip_blank();
            if self.peek() == Some(b':') {
                self.at += 1;
                let name = String::from_utf8_lossy(&self.bytes[first.value])
                    .trim_matches('"')
                    .to_owned();
                fields.push((name, self.value()?));
                self.skip_blank();
            } else {
                items.push(first);
            }
            match self.peek()? {
                b',' => self.at += 1,
                byte if byte == close => {}
                _ => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "// what it shows\n#![enable(implicit_some)]\n(\n    name: \"a (b\", // :\n    law: Folded(rate_per_s: 40.0, range: (6300.0, 7300)),\n    list: [(x: 1), (x: 2)],\n    limits: Some((top: -1e-3)),\n)";

    fn text_at(path: &str) -> &str {
        &TEXT[read(TEXT).unwrap().nearest(path).value.clone()]
    }

    #[test]
    fn finds_values_through_variants_lists_and_newtypes() {
        assert_eq!(text_at("name"), "\"a (b\"");
        assert_eq!(text_at("law.rate_per_s"), "40.0");
        assert_eq!(text_at("law.range.1"), "7300");
        assert_eq!(text_at("list.1.x"), "2");
        assert_eq!(text_at("limits.top"), "-1e-3");
        assert_eq!(
            text_at("law.missing"),
            "Folded(rate_per_s: 40.0, range: (6300.0, 7300))"
        );
    }

    #[test]
    fn sets_what_is_there_and_adds_what_is_not() {
        let place = read(TEXT).unwrap();
        assert!(
            place
                .set(TEXT, "law.rate_per_s", "50")
                .unwrap()
                .contains("rate_per_s: 50, range")
        );
        assert!(place.set(TEXT, "law.gain", "1").unwrap().contains("7300), gain: 1)"));
        assert!(place.set(TEXT, "seed", "7").unwrap().ends_with(",\nseed: 7)"));
        assert!(
            place
                .set(TEXT, "limits.low", "0")
                .unwrap()
                .contains("top: -1e-3, low: 0")
        );
        assert!(
            place
                .set(TEXT, "new.inner", "1")
                .unwrap()
                .ends_with(",\nnew: (inner: 1))")
        );
        assert!(place.set(TEXT, "name.inner", "1").is_err());
        let material = "(material: File(\"own.ron\"))";
        let refused = read(material).unwrap().set(material, "material.name", "1").unwrap_err();
        assert!(refused.starts_with("it stands in the file \"own.ron\"; "), "{refused}");
    }

    #[test]
    fn lists_are_taken_apart_at_their_own_commas() {
        assert_eq!(
            items("[1.0, Folded(a: (1, 2)), \"x, y\",]"),
            Some(vec!["1.0", "Folded(a: (1, 2))", "\"x, y\""])
        );
        for text in ["(1, 2)", "[1, 2] 3", "[1, 2", "1", "[a: 1]"] {
            assert_eq!(items(text), None, "{text}");
        }
        assert_eq!(items("[]"), Some(Vec::new()));
    }

    /// Guards against torn and hostile files: found by `tests/tests/torn_files.rs`.
    #[test]
    fn torn_texts_are_no_ron() {
        for text in ["#!", "#![x", "\"\\", "(a: \"\\", "", "/*", "(a: 1, // "] {
            assert_eq!(read(text), None, "{text}");
        }
        assert_eq!(read(&"(".repeat(1_000_000)), None);
    }

    #[test]
    fn counts_lines_and_columns_from_one() {
        assert_eq!(line_and_column(TEXT, 0), (1, 1));
        assert_eq!(line_and_column(TEXT, TEXT.find("law").unwrap()), (5, 5));
    }
}
