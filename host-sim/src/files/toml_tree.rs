//! TOML files read key by key, with errors that name file, line, key and what is allowed.
//!
//! A [`Document`] is the parsed tree with the line of every entry; `--set` changes it before it is
//! read. A [`TableReader`] hands out typed values and remembers which keys were asked for, so that
//! [`TableReader::finish`] can refuse every other key and list the allowed ones.
//! Left out: dates and times, which none of the project's files uses.

use std::cell::RefCell;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::input_error::InputError;

/// A condition on a number, with the words that describe it.
#[derive(Debug, Clone, Copy)]
pub struct Allowed {
    /// Whether a finite number is allowed.
    pub check: fn(f64) -> bool,
    /// The condition in words.
    pub words: &'static str,
}

/// Any finite number.
pub const FINITE: Allowed = Allowed { check: |_| true, words: "finite" };
/// x > 0
pub const POSITIVE: Allowed = Allowed { check: |x| x > 0.0, words: "> 0" };
/// x ≥ 0
pub const NOT_NEGATIVE: Allowed = Allowed { check: |x| x >= 0.0, words: ">= 0" };

/// Where an entry stands: a line of the file, or the `--set` that made it.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    Line(u64),
    Set,
}

#[derive(Debug, Clone)]
enum Node {
    Integer(i64),
    Number(f64),
    Text(String),
    Boolean(bool),
    List(Vec<Entry>),
    Table(Vec<(String, Entry)>),
    Unsupported(&'static str),
}

#[derive(Debug, Clone)]
struct Entry {
    node: Node,
    place: Place,
    written: String,
}

impl Entry {
    fn kind(&self) -> &'static str {
        match &self.node {
            Node::Integer(_) | Node::Number(_) => "a number",
            Node::Text(_) => "a string",
            Node::Boolean(_) => "true or false",
            Node::List(_) => "a list",
            Node::Table(_) => "a table",
            Node::Unsupported(kind) => kind,
        }
    }
}

/// A parsed TOML file.
#[derive(Debug, Clone)]
pub struct Document {
    file: String,
    root: Entry,
}

impl Document {
    /// Reads and parses a file.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = std::fs::read_to_string(path).map_err(|e| InputError::io(path, "read", &e))?;
        let name = path.display().to_string();
        crate::provenance::note_file(&name, text.as_bytes());
        Self::parse(&name, &text)
    }

    /// Parses a text; `file` is the name that errors will give.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let lines = Lines::new(text);
        let table = DeTable::parse(text).map_err(|e| {
            let error = InputError::new(format!("not valid TOML: {}", e.message())).file(file);
            match e.span() {
                Some(span) => error.line(lines.of(span.start)),
                None => error,
            }
        })?;
        let root = convert_table(table.get_ref(), text, &lines);
        let root = Entry { node: root, place: Place::Line(1), written: String::new() };
        Ok(Self { file: file.into(), root })
    }

    /// Changes or adds the entry at a dotted path; lists are indexed by number from 0.
    /// The value is read as TOML; what is not TOML is taken as a string.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), InputError> {
        let refuse = |problem: String| InputError::new(problem).file("--set").key(path).value(value);
        let mut entry = &mut self.root;
        for part in path.split('.') {
            let (name, kind) = (part.trim(), entry.kind());
            if name.is_empty() {
                return Err(refuse("empty part in the key".into()).allowed("names separated by dots"));
            }
            let new = || Entry { node: Node::Table(Vec::new()), place: Place::Set, written: String::new() };
            entry = match &mut entry.node {
                Node::Table(entries) => {
                    let at = match entries.iter().position(|(key, _)| key == name) {
                        Some(at) => at,
                        None => {
                            entries.push((name.into(), new()));
                            entries.len() - 1
                        }
                    };
                    &mut entries[at].1
                }
                Node::List(items) => {
                    let count = items.len();
                    match name.parse::<usize>().ok().and_then(|at| items.get_mut(at)) {
                        Some(item) => item,
                        None => {
                            return Err(refuse(format!("{name} is no entry of this list of {count}"))
                                .allowed(format!("0 to {}", count.saturating_sub(1))));
                        }
                    }
                }
                _ => return Err(refuse(format!("{name} cannot be set inside {kind}"))),
            };
        }
        let text = value.trim();
        let node = match DeValue::parse(text) {
            Ok(parsed) => convert(parsed.get_ref(), text, &Lines::new("")),
            Err(_) => Node::Text(text.into()),
        };
        *entry = Entry { node, place: Place::Set, written: text.into() };
        set_place(entry);
        Ok(())
    }

    /// The top-level table.
    pub fn root(&self) -> TableReader<'_> {
        let entries: &[(String, Entry)] = match &self.root.node {
            Node::Table(entries) => entries,
            _ => &[],
        };
        TableReader {
            file: &self.file,
            path: String::new(),
            place: self.root.place.clone(),
            entries,
            asked: RefCell::default(),
        }
    }
}

fn set_place(entry: &mut Entry) {
    entry.place = Place::Set;
    match &mut entry.node {
        Node::List(items) => items.iter_mut().for_each(set_place),
        Node::Table(entries) => entries.iter_mut().for_each(|(_, entry)| set_place(entry)),
        _ => {}
    }
}

/// Byte offsets of line starts.
struct Lines(Vec<usize>);

impl Lines {
    fn new(text: &str) -> Self {
        Self(std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }
    fn of(&self, offset: usize) -> u64 {
        self.0.partition_point(|&start| start <= offset) as u64
    }
}

fn convert(value: &DeValue<'_>, text: &str, lines: &Lines) -> Node {
    match value {
        DeValue::String(s) => Node::Text(s.to_string()),
        DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Node::Integer(i),
            Err(_) => Node::Unsupported("an integer beyond 64 bits"),
        },
        DeValue::Float(x) => match x.as_str().parse() {
            Ok(x) => Node::Number(x),
            Err(_) => Node::Unsupported("a float that cannot be read"),
        },
        DeValue::Boolean(b) => Node::Boolean(*b),
        DeValue::Datetime(_) => Node::Unsupported("a date or time"),
        DeValue::Array(items) => Node::List(
            items
                .iter()
                .map(|item| Entry {
                    node: convert(item.get_ref(), text, lines),
                    place: Place::Line(lines.of(item.span().start)),
                    written: text.get(item.span()).unwrap_or_default().into(),
                })
                .collect(),
        ),
        DeValue::Table(table) => convert_table(table, text, lines),
    }
}

fn convert_table(table: &DeTable<'_>, text: &str, lines: &Lines) -> Node {
    let entries = table.iter().map(|(key, value)| {
        let place = Place::Line(lines.of(key.span().start));
        let written = text.get(value.span()).unwrap_or_default().into();
        (key.get_ref().to_string(), Entry { node: convert(value.get_ref(), text, lines), place, written })
    });
    Node::Table(entries.collect())
}

/// One table of a [`Document`], read key by key.
#[derive(Debug)]
pub struct TableReader<'a> {
    file: &'a str,
    path: String,
    place: Place,
    entries: &'a [(String, Entry)],
    asked: RefCell<Vec<String>>,
}

impl<'a> TableReader<'a> {
    /// The dotted path of a key of this table.
    pub fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) }
    }

    /// The keys of this table, in the file's order.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.entries.iter().map(|(key, _)| key.as_str())
    }

    /// Whether the key is there; does not make it an allowed one.
    pub fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|(name, _)| name == key)
    }

    fn get(&self, key: &str) -> Option<&'a Entry> {
        let mut asked = self.asked.borrow_mut();
        if !asked.iter().any(|name| name == key) {
            asked.push(key.into());
        }
        self.entries.iter().find(|(name, _)| name == key).map(|(_, entry)| entry)
    }

    fn located(&self, place: &Place, error: InputError) -> InputError {
        match place {
            Place::Line(line) => error.file(self.file).line(*line),
            Place::Set => error.file(format!("{} with --set", self.file)),
        }
    }

    /// An error about a key of this table: its line and value are filled in where it is there.
    pub fn error(&self, key: &str, problem: impl Into<String>) -> InputError {
        let error = InputError::new(problem).key(self.path_of(key));
        match self.entries.iter().find(|(name, _)| name == key) {
            Some((_, entry)) if matches!(entry.node, Node::Table(_) | Node::List(_)) => {
                self.located(&entry.place, error)
            }
            Some((_, entry)) => self.located(&entry.place, error.value(&entry.written)),
            None => self.located(&self.place, error),
        }
    }

    fn wrong_type(&self, key: &str, entry: &Entry, wanted: &str) -> InputError {
        self.error(key, format!("is {}", entry.kind())).allowed(wanted)
    }

    /// A number, checked; `None` where the key is not there.
    pub fn number(&self, key: &str, allowed: Allowed) -> Result<Option<f64>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        let value = match entry.node {
            Node::Number(x) => x,
            Node::Integer(i) => i as f64,
            _ => return Err(self.wrong_type(key, entry, &format!("a number, {}", allowed.words))),
        };
        if value.is_finite() && (allowed.check)(value) {
            Ok(Some(value))
        } else {
            Err(self.error(key, "out of range").allowed(allowed.words))
        }
    }

    /// A number that must be there.
    pub fn required_number(&self, key: &str, allowed: Allowed) -> Result<f64, InputError> {
        self.number(key, allowed)?.ok_or_else(|| self.missing(key, &format!("a number, {}", allowed.words)))
    }

    /// An integer in a range; `None` where the key is not there.
    pub fn integer(&self, key: &str, low: u64, high: u64) -> Result<Option<u64>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        let words = format!("a whole number from {low} to {high}");
        let value = match entry.node {
            Node::Integer(i) => u64::try_from(i).ok(),
            // A whole number written as a float, as in `120e3`.
            Node::Number(x) if x.fract() == 0.0 && (0.0..1.8e19).contains(&x) => Some(x as u64),
            Node::Number(_) => None,
            _ => return Err(self.wrong_type(key, entry, &words)),
        };
        match value {
            Some(value) if (low..=high).contains(&value) => Ok(Some(value)),
            _ => Err(self.error(key, "out of range").allowed(words)),
        }
    }

    /// A string; `None` where the key is not there.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        match &entry.node {
            Node::Text(text) => Ok(Some(text)),
            _ => Err(self.wrong_type(key, entry, "a string in quotes")),
        }
    }

    /// One of several words; `None` where the key is not there.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, InputError> {
        let Some(text) = self.text(key)? else { return Ok(None) };
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        choices
            .iter()
            .find(|(name, _)| *name == text)
            .map(|(_, choice)| Some(*choice))
            .ok_or_else(|| self.error(key, "not known").allowed(names.join(", ")))
    }

    /// True or false; `None` where the key is not there.
    pub fn boolean(&self, key: &str) -> Result<Option<bool>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        match entry.node {
            Node::Boolean(value) => Ok(Some(value)),
            _ => Err(self.wrong_type(key, entry, "true or false")),
        }
    }

    /// A list of finite numbers; `None` where the key is not there.
    pub fn numbers(&self, key: &str, allowed: Allowed) -> Result<Option<Vec<f64>>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        let wanted = format!("a list of numbers, each {}", allowed.words);
        let Node::List(items) = &entry.node else { return Err(self.wrong_type(key, entry, &wanted)) };
        let mut values = Vec::with_capacity(items.len());
        for (at, item) in items.iter().enumerate() {
            let value = match item.node {
                Node::Number(x) => x,
                Node::Integer(i) => i as f64,
                _ => f64::NAN,
            };
            if !value.is_finite() || !(allowed.check)(value) {
                let error = InputError::new("out of range").key(format!("{}.{at}", self.path_of(key)));
                return Err(self.located(&item.place, error.value(&item.written)).allowed(wanted));
            }
            values.push(value);
        }
        Ok(Some(values))
    }

    /// A table inside this one; `None` where it is not there.
    pub fn table(&self, key: &str) -> Result<Option<TableReader<'a>>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(None) };
        match &entry.node {
            Node::Table(entries) => Ok(Some(TableReader {
                file: self.file,
                path: self.path_of(key),
                place: entry.place.clone(),
                entries,
                asked: RefCell::default(),
            })),
            _ => Err(self.wrong_type(key, entry, &format!("a table, [{}]", self.path_of(key)))),
        }
    }

    /// The tables of a list of tables; empty where the key is not there.
    pub fn tables(&self, key: &str) -> Result<Vec<TableReader<'a>>, InputError> {
        let Some(entry) = self.get(key) else { return Ok(Vec::new()) };
        let wanted = format!("tables, each headed [[{}]]", self.path_of(key));
        let Node::List(items) = &entry.node else { return Err(self.wrong_type(key, entry, &wanted)) };
        items
            .iter()
            .enumerate()
            .map(|(at, item)| match &item.node {
                Node::Table(entries) => Ok(TableReader {
                    file: self.file,
                    path: format!("{}.{at}", self.path_of(key)),
                    place: item.place.clone(),
                    entries,
                    asked: RefCell::default(),
                }),
                _ => Err(self.wrong_type(key, item, &wanted)),
            })
            .collect()
    }

    /// The error for a key that must be there and is not.
    pub fn missing(&self, key: &str, wanted: &str) -> InputError {
        self.error(key, "is missing").allowed(wanted)
    }

    /// Refuses every key that was not asked for, and lists those that were.
    pub fn finish(&self) -> Result<(), InputError> {
        let asked = self.asked.borrow();
        match self.entries.iter().find(|(key, _)| !asked.contains(key)) {
            Some((key, _)) => Err(self.error(key, "unknown key").allowed(asked.join(", "))),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        Document::parse("f.toml", "a = 1\n[t]\nb = -2.5\nn = nan\n[[s]]\nx = 1\n[[s]]\nx = 2\n").unwrap()
    }

    #[test]
    fn numbers_are_read_and_ranges_are_named() {
        let document = document();
        let root = document.root();
        assert_eq!(root.number("a", POSITIVE), Ok(Some(1.0)));
        let t = root.table("t").unwrap().unwrap();
        let error = t.number("b", POSITIVE).unwrap_err();
        assert_eq!(error.to_string(), "f.toml:3: t.b = -2.5: out of range; allowed: > 0");
        let error = t.number("n", FINITE).unwrap_err();
        assert_eq!(error.to_string(), "f.toml:4: t.n = nan: out of range; allowed: finite");
    }

    #[test]
    fn an_unknown_key_is_refused_and_the_known_ones_are_listed() {
        let document = document();
        let t = document.root().table("t").unwrap().unwrap();
        t.number("b", FINITE).unwrap();
        t.number("c", FINITE).unwrap();
        let error = t.finish().unwrap_err();
        assert_eq!(error.to_string(), "f.toml:4: t.n = nan: unknown key; allowed: b, c");
    }

    #[test]
    fn set_changes_an_entry_by_its_dotted_path_and_is_named_in_errors() {
        let mut document = document();
        document.set("s.1.x", "-7").unwrap();
        document.set("new.kind", "series").unwrap();
        let root = document.root();
        assert_eq!(root.table("new").unwrap().unwrap().text("kind"), Ok(Some("series")));
        let error = root.tables("s").unwrap()[1].number("x", POSITIVE).unwrap_err();
        assert_eq!(error.to_string(), "f.toml with --set: s.1.x = -7: out of range; allowed: > 0");
        assert_eq!(
            document.set("s.2.x", "1").unwrap_err().to_string(),
            "--set: s.2.x = 1: 2 is no entry of this list of 2; allowed: 0 to 1"
        );
        assert!(document.set("a.b", "1").unwrap_err().to_string().contains("inside a number"));
    }

    #[test]
    fn a_syntax_error_names_its_line() {
        let error = Document::parse("f.toml", "a = 1\nb = = 2\n").unwrap_err().to_string();
        assert!(error.starts_with("f.toml:2: not valid TOML: "), "{error}");
    }
}
