//! Changes of a text that leave everything else as it is, and their unified diff.

use super::xml::Element;
use std::ops::Range;

/// Lines of context around a change.
const CONTEXT: usize = 3;

/// Replacements in a text, none of which overlaps another.
pub(super) struct Edits<'a> {
    text: &'a str,
    list: Vec<(Range<usize>, String)>,
}

impl<'a> Edits<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Edits { text, list: Vec::new() }
    }

    pub(super) fn replace(&mut self, range: Range<usize>, by: String) {
        self.list.push((range, by));
    }

    /// Gives an attribute a value.
    pub(super) fn set(&mut self, element: &Element, name: &str, value: &str) {
        match element.attributes.iter().find(|a| a.name == name) {
            Some(attribute) => self.replace(attribute.inner.clone(), value.to_owned()),
            None => {
                let end = element.attributes.last().map_or(element.tag.start + 1 + element.name.len(), |a| a.whole.end);
                self.replace(end..end, format!(" {name}=\"{value}\""));
            }
        }
    }

    /// Takes an attribute away.
    pub(super) fn remove(&mut self, element: &Element, name: &str) {
        if let Some(attribute) = element.attributes.iter().find(|a| a.name == name) {
            self.replace(attribute.whole.clone(), String::new());
        }
    }

    /// Says before an element why it changes.
    pub(super) fn note(&mut self, element: &Element, why: &[&str]) {
        let indent = self.indent(element);
        let comments: String = why.iter().map(|w| format!("{}\n{indent}", comment(w))).collect();
        self.replace(element.tag.start..element.tag.start, comments);
    }

    /// A first child, which says before it why it is there.
    pub(super) fn insert(&mut self, parent: &Element, child: &str, why: &[&str]) {
        let indent = self.indent(parent);
        let mut lines: String = why.iter().map(|w| format!("\n{indent}  {}", comment(w))).collect();
        lines.push_str(&format!("\n{indent}  {child}"));
        let end = parent.tag.end;
        if self.text[parent.tag.clone()].ends_with("/>") {
            match self.list.iter_mut().find(|(range, _)| *range == (end - 2..end)) {
                Some((_, open)) => open.insert_str(1, &lines),
                None => self.replace(end - 2..end, format!(">{lines}\n{indent}</{}>", parent.name)),
            }
        } else {
            self.replace(end..end, lines);
        }
    }

    /// The white space that begins the line of an element.
    fn indent(&self, element: &Element) -> &'a str {
        let line = self.text[..element.tag.start].rfind('\n').map_or(0, |k| k + 1);
        let rest = &self.text[line..];
        &rest[..rest.len() - rest.trim_start().len()]
    }

    /// The text with its changes.
    pub(super) fn applied(&mut self) -> String {
        // Stable: what is put at one place keeps its order.
        self.list.sort_by_key(|(range, _)| (range.start, range.end));
        self.apply(0..self.text.len())
    }

    /// A stretch of it that no change crosses.
    fn apply(&self, stretch: Range<usize>) -> String {
        let (mut out, mut at) = (String::new(), stretch.start);
        for (range, by) in self.list.iter().filter(|(r, _)| r.start >= stretch.start && r.end <= stretch.end) {
            out.push_str(&self.text[at..range.start]);
            out.push_str(by);
            at = range.end;
        }
        out + &self.text[at..stretch.end]
    }

    /// The unified diff of `file`, after [`Edits::applied`].
    pub(super) fn patch(&self, file: &str) -> String {
        let starts: Vec<usize> = std::iter::once(0).chain(self.text.match_indices('\n').map(|(k, _)| k + 1)).filter(|k| *k < self.text.len()).collect();
        let line = |byte: usize| starts.partition_point(|s| *s <= byte).max(1) - 1;
        let begin = |line: usize| starts.get(line).copied().unwrap_or(self.text.len());
        // Lines that change, as blocks that no change crosses, and those a context apart as one.
        let mut blocks: Vec<Range<usize>> = Vec::new();
        for (range, _) in &self.list {
            let lines = line(range.start)..line(range.end) + 1;
            match blocks.last_mut() {
                Some(last) if lines.start <= last.end + 2 * CONTEXT => last.end = last.end.max(lines.end),
                _ => blocks.push(lines),
            }
        }
        let (mut out, mut more, mut fewer) = (format!("--- {file}\n+++ {file}\n"), 0, 0);
        for block in blocks {
            let lines = block.start.saturating_sub(CONTEXT)..(block.end + CONTEXT).min(starts.len());
            let stretch = begin(lines.start)..begin(lines.end);
            let (old, new) = (&self.text[stretch.clone()], self.apply(stretch));
            let (old, new): (Vec<&str>, Vec<&str>) = (old.split_inclusive('\n').collect(), new.split_inclusive('\n').collect());
            let first = lines.start + 1;
            out.push_str(&format!("@@ -{first},{} +{},{} @@\n", old.len(), first + more - fewer, new.len()));
            (more, fewer) = (more + new.len(), fewer + old.len());
            compared(&old, &new, &mut out);
        }
        out
    }
}

/// The lines of a hunk: by the longest common subsequence, which is short work for few lines.
fn compared(old: &[&str], new: &[&str], out: &mut String) {
    let mut common = vec![vec![0_usize; new.len() + 1]; old.len() + 1];
    for i in (0..old.len()).rev() {
        for j in (0..new.len()).rev() {
            common[i][j] = if old[i] == new[j] { common[i + 1][j + 1] + 1 } else { common[i + 1][j].max(common[i][j + 1]) };
        }
    }
    let (mut i, mut j) = (0, 0);
    let mut say = |sign: char, line: &str| {
        out.push(sign);
        out.push_str(line);
        if !line.ends_with('\n') {
            out.push_str("\n\\ No newline at end of file\n");
        }
    };
    while i < old.len() || j < new.len() {
        if i < old.len() && j < new.len() && old[i] == new[j] {
            say(' ', old[i]);
            (i, j) = (i + 1, j + 1);
        } else if i < old.len() && (j == new.len() || common[i + 1][j] >= common[i][j + 1]) {
            say('-', old[i]);
            i += 1;
        } else {
            say('+', new[j]);
            j += 1;
        }
    }
}

/// One line of words.
pub(super) fn one_line(why: &str) -> String {
    why.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// An XML comment, in which no two hyphens may follow each other.
fn comment(why: &str) -> String {
    let mut words = one_line(why);
    while words.contains("--") {
        words = words.replace("--", "- -");
    }
    format!("<!-- {words} -->")
}
