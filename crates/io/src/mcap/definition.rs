//! Message definitions as ROS writes them: a type and a name a line.

use crate::number::Number;
use std::collections::BTreeMap;

/// Bytes of a type's definitions; those of ROS have a few thousand.
const MAX_TEXT: usize = 1 << 20;

/// What a field is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Number),
    Text,
    WideText,
    /// Seconds and nanoseconds; whether the seconds have a sign.
    Time(bool),
    /// Another message.
    Message(String),
}

/// How many of them there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Counted,
}

/// One line of a definition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
}

/// A message and all that it is made of, by `package/Type`.
#[derive(Clone, Debug, Default)]
pub(super) struct Definitions {
    pub root: String,
    pub messages: BTreeMap<String, Vec<Field>>,
}

impl Definitions {
    /// Reads the definitions of message `name`: its own, then those of its parts behind lines of `=` and `MSG: package/Type`.
    pub fn parse(name: &str, text: &str) -> Option<Self> {
        if text.len() > MAX_TEXT {
            return None;
        }
        let mut found = Definitions { root: plain(name), messages: BTreeMap::new() };
        let mut current = found.root.clone();
        let mut fields = Vec::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.starts_with("===") {
                continue;
            }
            if let Some(name) = line.strip_prefix("MSG:") {
                found.messages.entry(std::mem::replace(&mut current, plain(name.trim()))).or_insert(std::mem::take(&mut fields));
                continue;
            }
            if let Some(field) = field(line, &current)? {
                fields.push(field);
            }
        }
        found.messages.entry(current).or_insert(fields);
        Some(found)
    }
}

/// `package/msg/Type` is `package/Type`.
fn plain(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// The field of a line of message `current`; nothing for a constant or an empty line, [`None`] if it is not understood.
fn field(line: &str, current: &str) -> Option<Option<Field>> {
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else { return line.is_empty().then_some(None) };
    let rest = rest.trim();
    let name = rest.split(|c: char| c.is_whitespace() || c == '=').next().unwrap_or_default();
    if rest[name.len()..].trim_start().starts_with('=') {
        return Some(None);
    }
    let (kind, count) = match kind.strip_suffix(']').and_then(|k| k.split_once('[')) {
        Some((kind, "")) => (kind, Count::Counted),
        Some((kind, bound)) if bound.starts_with("<=") => (kind, Count::Counted),
        Some((kind, size)) => (kind, Count::Fixed(size.parse().ok()?)),
        None => (kind, Count::One),
    };
    let kind = match kind.split("<=").next().unwrap_or(kind) {
        "bool" | "byte" | "char" | "uint8" => Kind::Number(Number::U8),
        "int8" => Kind::Number(Number::I8),
        "uint16" => Kind::Number(Number::U16),
        "int16" => Kind::Number(Number::I16),
        "uint32" => Kind::Number(Number::U32),
        "int32" => Kind::Number(Number::I32),
        "uint64" => Kind::Number(Number::U64),
        "int64" => Kind::Number(Number::I64),
        "float32" => Kind::Number(Number::F32),
        "float64" => Kind::Number(Number::F64),
        "string" => Kind::Text,
        "wstring" => Kind::WideText,
        "time" => Kind::Time(false),
        "duration" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time" | "builtin_interfaces/Duration" | "builtin_interfaces/msg/Duration" => {
            Kind::Time(true)
        }
        "Header" => Kind::Message("std_msgs/Header".to_owned()),
        other if other.contains('/') => Kind::Message(plain(other)),
        other => Kind::Message(format!("{}/{other}", current.split('/').next().unwrap_or_default())),
    };
    Some(Some(Field { name: name.to_owned(), kind, count }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_definitions_are_understood() {
        let text = "# a comment\nstd_msgs/Header header\nuint8 OK=1\nstring<=10 name # why\nfloat64[] position\nfloat32[3] axis\nPart[<=4] parts\nint8 flag 3\n\
            ================================================================================\nMSG: lab_msgs/Part\nbool on\n===\nMSG: std_msgs/Header\n\
            builtin_interfaces/Time stamp\nstring frame_id\n";
        let found = Definitions::parse("lab_msgs/msg/State", text).unwrap();
        let field = |name: &str, kind, count| Field { name: name.to_owned(), kind, count };
        let part = Kind::Message("lab_msgs/Part".to_owned());
        assert_eq!(
            found.messages["lab_msgs/State"],
            [
                field("header", Kind::Message("std_msgs/Header".to_owned()), Count::One),
                field("name", Kind::Text, Count::One),
                field("position", Kind::Number(Number::F64), Count::Counted),
                field("axis", Kind::Number(Number::F32), Count::Fixed(3)),
                field("parts", part, Count::Counted),
                field("flag", Kind::Number(Number::I8), Count::One),
            ]
        );
        assert_eq!(found.messages["std_msgs/Header"][0], field("stamp", Kind::Time(true), Count::One));
        assert_eq!(found.messages["lab_msgs/Part"], [field("on", Kind::Number(Number::U8), Count::One)]);
        assert!(Definitions::parse("a/B", "float64[x] a").is_none());
    }
}
