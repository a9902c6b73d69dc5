//! The part of XML that robot descriptions use: elements, attributes, comments; and where each stands in its text.

use std::ops::Range;

/// An element with its attributes and children; text is left out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
    pub(super) line: usize,
    /// Bytes of its opening tag.
    pub(super) tag: Range<usize>,
}

/// An attribute of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) value: String,
    /// Its bytes, the white space before it included.
    pub(super) whole: Range<usize>,
    /// The bytes between its quotes.
    pub(super) inner: Range<usize>,
}

impl Element {
    /// The value of an attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.name == name).map(|a| a.value.as_str())
    }

    /// The value of an attribute that there has to be.
    pub(super) fn required(&self, name: &str) -> Result<&str, String> {
        self.attribute(name).ok_or_else(|| format!("line {}: <{}> has no {name}", self.line, self.name))
    }

    /// The numbers of an attribute.
    pub(super) fn list(&self, name: &str) -> Result<Vec<f64>, String> {
        let text = self.required(name)?;
        let values: Option<Vec<f64>> = text.split_whitespace().map(|v| v.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        values.ok_or_else(|| format!("line {}: {name}=\"{text}\" of <{}> is no number", self.line, self.name))
    }

    /// So many numbers of an attribute, or those of `absent` where it is not there.
    pub(super) fn numbers<const N: usize>(&self, name: &str, absent: Option<[f64; N]>) -> Result<[f64; N], String> {
        if let (None, Some(absent)) = (self.attribute(name), absent) {
            return Ok(absent);
        }
        let list = self.list(name)?;
        let count = ["no", "one number", "two numbers", "three numbers"].get(N).map_or(format!("{N} numbers"), |w| (*w).to_owned());
        list.try_into().map_err(|_| format!("line {}: {name}=\"{}\" of <{}> is not {count}", self.line, self.attribute(name).unwrap_or_default(), self.name))
    }

    /// A number, or `absent`.
    pub(super) fn number(&self, name: &str, absent: f64) -> Result<f64, String> {
        self.numbers(name, Some([absent])).map(|[v]| v)
    }

    /// What it is called in a message: its line, its kind and its name.
    pub(super) fn called(&self) -> String {
        let name = self.attribute("name").map_or(String::new(), |n| format!(" \"{n}\""));
        format!("line {}: <{}>{name}", self.line, self.name)
    }

    /// The first child of that name.
    pub(super) fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|c| c.name == name)
    }

    /// All children of that name.
    pub(super) fn children<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |c| c.name == name)
    }
}

/// Deepest nesting accepted: descriptions need five.
const DEEPEST: usize = 64;

/// Reads the root element.
pub(super) fn parse(text: &str) -> Result<Element, String> {
    let mut open: Vec<Element> = Vec::new();
    let mut at = 0;
    let line_at = |at: usize| 1 + text[..at].matches('\n').count();
    while let Some(start) = text[at..].find('<').map(|k| at + k) {
        let rest = &text[start..];
        let line = line_at(start);
        let skip = |opening: &str, closing: &str| -> Option<Result<usize, String>> {
            let body = rest.strip_prefix(opening)?;
            Some(
                body.find(closing)
                    .map(|k| start + opening.len() + k + closing.len())
                    .ok_or(format!("line {line}: \"{opening}\" is never closed by \"{closing}\"")),
            )
        };
        if let Some(end) = skip("<!--", "-->").or_else(|| skip("<?", "?>")).or_else(|| skip("<![CDATA[", "]]>")).or_else(|| skip("<!", ">")) {
            at = end?;
            continue;
        }
        let (mut quote, mut end) = (None, None);
        for (k, c) in rest.char_indices() {
            match (quote, c) {
                (None, '"' | '\'') => quote = Some(c),
                (Some(q), c) if c == q => quote = None,
                (None, '>') => {
                    end = Some(k);
                    break;
                }
                _ => {}
            }
        }
        let end = end.ok_or(format!("line {line}: a tag begins and never ends"))?;
        at = start + end + 1;
        let body = &rest[1..end];
        if let Some(name) = body.strip_prefix('/') {
            let element = open.pop().filter(|e| e.name == name.trim()).ok_or(format!("line {line}: </{}> closes nothing that is open", name.trim()))?;
            match open.last_mut() {
                Some(parent) => parent.children.push(element),
                None => return Ok(element),
            }
            continue;
        }
        let (body, closed) = body.strip_suffix('/').map_or((body, false), |b| (b, true));
        let name_end = body.find(char::is_whitespace).unwrap_or(body.len());
        if name_end == 0 {
            return Err(format!("line {line}: a tag without a name"));
        }
        let attributes = attributes(&body[name_end..], start + 1 + name_end, line)?;
        let element = Element { name: body[..name_end].to_owned(), attributes, children: Vec::new(), line, tag: start..at };
        if !closed {
            if open.len() == DEEPEST {
                return Err(format!("line {line}: elements are nested more than {DEEPEST} deep"));
            }
            open.push(element);
        } else if let Some(parent) = open.last_mut() {
            parent.children.push(element);
        } else {
            return Ok(element);
        }
    }
    Err(match open.last() {
        Some(element) => format!("line {}: <{}> is never closed", element.line, element.name),
        None => "no element at all; a URDF begins with <robot>, an MJCF with <mujoco>".to_owned(),
    })
}

/// The attributes in `text`, whose first byte is the `at`-th of the file.
fn attributes(text: &str, at: usize, line: usize) -> Result<Vec<Attribute>, String> {
    let mut list = Vec::new();
    let mut rest = text;
    loop {
        let begin = at + text.len() - rest.len();
        rest = rest.trim_start();
        if rest.is_empty() {
            return Ok(list);
        }
        let broken = || format!("line {line}: \"{}\" is no attribute=\"value\"", rest.trim_end());
        let (name, after) = rest.split_once('=').ok_or_else(broken)?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\'')).ok_or_else(broken)?;
        let (inner, behind) = after[1..].split_once(quote).ok_or_else(broken)?;
        let end = at + text.len() - behind.len();
        let value = inner.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&apos;", "'").replace("&amp;", "&");
        list.push(Attribute { name: name.trim().to_owned(), value, whole: begin..end, inner: end - 1 - inner.len()..end - 1 });
        rest = behind;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_nest_and_comments_vanish() {
        let root = parse("<?xml version=\"1.0\"?>\n<!-- a > b -->\n<robot name='r &amp; d'>\n <link name=\"a>b\"/><!-- <link/> -->\n <link name=\"c\"><mass value = \"1\" /></link>\n</robot>")
            .expect("valid");
        assert_eq!((root.name.as_str(), root.attribute("name"), root.line), ("robot", Some("r & d"), 3));
        let names: Vec<_> = root.children("link").map(|l| l.attribute("name")).collect();
        assert_eq!(names, [Some("a>b"), Some("c")]);
        assert_eq!(root.children[1].child("mass").and_then(|m| m.attribute("value")), Some("1"));
    }

    #[test]
    fn what_is_broken_is_named_with_its_line() {
        for (text, place) in [
            ("<robot>\n<link>\n</robot>", "line 3"),
            ("<robot>\n<link name=a/></robot>", "line 2"),
            ("<robot>\n<!-- never", "line 2"),
            ("<robot><link name=\"x", "line 1"),
            ("", "no element"),
            ("<robot>", "never closed"),
            ("< ></>", "without a name"),
        ] {
            let error = parse(text).expect_err(text);
            assert!(error.contains(place), "{text}: {error}");
        }
    }
}
