//! Builds every mutant of a crate into one program, each behind a switch.
//!
//! `switches TREE < MUTANTS > RANGES` reads what `cargo mutants --list --json` prints, with a number `id` added to each mutant, and rewrites
//! the files that it names below `TREE`: `a + b` becomes `if on(7) { a - b } else if on(8) { a * b } else { a + b }`, and so on.
//! What `on` is, the crate is given by `.ci/mutants`. Prints where in the new files each switch stands, so that those that do not compile
//! can be taken out.
use std::{
    collections::BTreeMap,
    fs,
    io::{Read, stdin},
    ops::Range,
    path::Path,
};

use proc_macro2::{LineColumn, Span};
use serde_json::{Value, json};
use syn::{
    Arm, BinOp, Block, Expr, ExprBinary, ExprMatch, ExprStruct, ExprUnary, ImplItemFn, ItemFn, Member, TraitItemFn,
    spanned::Spanned,
    visit::{self, Visit},
};

/// A mutant: its number and what stands in place of what it changes.
type Mutant = (u64, String);

/// Mutants by line, column and kind: an operator may stand where its function begins.
type Places = BTreeMap<(usize, usize, String), Vec<Mutant>>;

/// How a place in the source is rewritten; its parts are rewritten in turn.
enum Form {
    Binary { left: Range<usize>, operator: String, right: Range<usize> },
    Unary { operator: String, operand: Range<usize> },
    Guard { guard: Option<Range<usize>>, of_guard: Vec<Mutant>, of_arm: Vec<Mutant> },
    Field { path: String, name: String, value: Range<usize>, rest: Range<usize> },
    Start,
}

struct Edit {
    range: Range<usize>,
    form: Form,
    mutants: Vec<Mutant>,
    within: Vec<usize>,
}

struct Finder<'a> {
    source: &'a str,
    at: Places,
    edits: Vec<Edit>,
    current: Option<usize>,
    top: Vec<usize>,
}

impl Finder<'_> {
    fn take(&mut self, start: LineColumn, kind: &str) -> Vec<Mutant> {
        self.at.remove(&(start.line, start.column + 1, kind.to_owned())).unwrap_or_default()
    }

    fn push(&mut self, range: Range<usize>, form: Form, mutants: Vec<Mutant>) -> usize {
        self.edits.push(Edit { range, form, mutants, within: vec![] });
        let new = self.edits.len() - 1;
        match self.current {
            Some(c) => self.edits[c].within.push(new),
            None => self.top.push(new),
        }
        new
    }

    /// What is visited by `inner` lies within `edit`.
    fn within(&mut self, edit: usize, inner: impl FnOnce(&mut Self)) {
        let before = self.current.replace(edit);
        inner(self);
        self.current = before;
    }

    fn body(&mut self, block: &Block) {
        let Some(first) = block.stmts.first() else { return };
        let mutants = self.take(first.span().start(), "FnValue");
        if !mutants.is_empty() {
            let start = block.brace_token.span.open().byte_range().end;
            self.push(start..start, Form::Start, mutants);
        }
    }
}

fn bytes(node: &impl Spanned) -> Range<usize> {
    let span: Span = node.span();
    // Of several tokens a span joins the first and the last one only.
    span.byte_range()
}

/// Whether a chain of conditions binds names, which only `if` and `while` may do.
fn binds(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(b) => binds(&b.left) || binds(&b.right),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_item_fn(&mut self, node: &'ast ItemFn) {
        self.body(&node.block);
        visit::visit_item_fn(self, node);
    }

    fn visit_impl_item_fn(&mut self, node: &'ast ImplItemFn) {
        self.body(&node.block);
        visit::visit_impl_item_fn(self, node);
    }

    fn visit_trait_item_fn(&mut self, node: &'ast TraitItemFn) {
        if let Some(block) = &node.default {
            self.body(block);
        }
        visit::visit_trait_item_fn(self, node);
    }

    fn visit_expr_binary(&mut self, node: &'ast ExprBinary) {
        let lazy = matches!(node.op, BinOp::And(_) | BinOp::Or(_));
        let mutants = if lazy && (binds(&node.left) || binds(&node.right)) { vec![] } else { self.take(node.op.span().start(), "BinaryOperator") };
        if mutants.is_empty() {
            return visit::visit_expr_binary(self, node);
        }
        let operator = self.source[bytes(&node.op)].to_owned();
        let edit = self.push(bytes(node), Form::Binary { left: bytes(&node.left), operator, right: bytes(&node.right) }, mutants);
        self.within(edit, |f| visit::visit_expr_binary(f, node));
    }

    fn visit_expr_unary(&mut self, node: &'ast ExprUnary) {
        let mutants = self.take(node.op.span().start(), "UnaryOperator");
        if mutants.is_empty() {
            return visit::visit_expr_unary(self, node);
        }
        let operator = self.source[bytes(&node.op)].to_owned();
        let edit = self.push(bytes(node), Form::Unary { operator, operand: bytes(&node.expr) }, mutants);
        self.within(edit, |f| visit::visit_expr_unary(f, node));
    }

    fn visit_expr_match(&mut self, node: &'ast ExprMatch) {
        self.visit_expr(&node.expr);
        for arm in &node.arms {
            self.arm(arm);
        }
    }

    fn visit_expr_struct(&mut self, node: &'ast ExprStruct) {
        let Some(rest) = &node.rest else { return visit::visit_expr_struct(self, node) };
        for field in &node.fields {
            let mutants = self.take(field.span().start(), "StructField");
            let Member::Named(name) = &field.member else { continue };
            if mutants.is_empty() {
                self.visit_expr(&field.expr);
                continue;
            }
            let form = Form::Field { path: self.source[bytes(&node.path)].to_owned(), name: name.to_string(), value: bytes(&field.expr), rest: bytes(rest) };
            let edit = self.push(bytes(field), form, mutants);
            self.within(edit, |f| f.visit_expr(&field.expr));
        }
        self.visit_expr(rest);
    }
}

impl Finder<'_> {
    fn arm(&mut self, arm: &Arm) {
        let guard = arm.guard.as_ref().map(|(_, g)| g);
        let of_guard = match guard {
            Some(g) if !binds(g) => self.take(g.span().start(), "MatchArmGuard"),
            _ => vec![],
        };
        let of_arm = self.take(arm.span().start(), "MatchArm");
        if of_guard.is_empty() && of_arm.is_empty() {
            return visit::visit_arm(self, arm);
        }
        let end = bytes(&arm.pat).end;
        let range = guard.map_or(end..end, bytes);
        let form = Form::Guard { guard: guard.map(bytes), of_guard: of_guard.clone(), of_arm: of_arm.clone() };
        let edit = self.push(range, form, [of_guard, of_arm].concat());
        if let Some(g) = guard {
            self.within(edit, |f| f.visit_expr(g));
        }
        self.visit_expr(&arm.body);
    }
}

/// A file as it is written, and where in it the switches stand.
struct Writer<'a> {
    source: &'a str,
    edits: &'a [Edit],
    out: String,
    ranges: Vec<(Range<usize>, Vec<u64>)>,
}

impl Writer<'_> {
    fn copy(&mut self, range: Range<usize>, inside: &[usize]) {
        let mut at = range.start;
        for &i in inside {
            let edit = &self.edits[i];
            if edit.range.start < range.start || edit.range.end > range.end {
                continue;
            }
            self.out += &self.source[at..edit.range.start];
            self.edit(edit);
            at = edit.range.end;
        }
        self.out += &self.source[at..range.end];
    }

    fn choice(&mut self, id: u64, write: impl FnOnce(&mut Self)) {
        self.out += &format!("if crate::switches::on({id}) ");
        let start = self.out.len();
        self.out += "{ ";
        write(self);
        self.out += " } ";
        self.ranges.push((start..self.out.len(), vec![id]));
    }

    fn edit(&mut self, edit: &Edit) {
        let start = self.out.len();
        match &edit.form {
            Form::Start => {
                for (id, to) in &edit.mutants {
                    self.choice(*id, |w| w.out += &format!("return {to};"));
                }
            }
            Form::Unary { operator, operand } => {
                self.out += "(match ";
                self.copy(operand.clone(), &edit.within);
                self.out += " { l_ => ";
                for (id, to) in &edit.mutants {
                    self.choice(*id, |w| w.out += &format!("{to} l_"));
                    self.out += "else ";
                }
                self.out += &format!("{{ {operator} l_ }} }})");
            }
            Form::Binary { left, operator, right } if operator == "&&" || operator == "||" => {
                // (¬a ∧ ¬b) is ¬(a ∨ b): what is not evaluated stays so.
                let id = edit.mutants[0].0;
                self.out += &format!("(crate::switches::on({id}) ^ ((crate::switches::on({id}) ^ (");
                self.copy(left.clone(), &edit.within);
                self.out += &format!(")) {operator} (crate::switches::on({id}) ^ (");
                self.copy(right.clone(), &edit.within);
                self.out += "))))";
            }
            Form::Binary { left, operator, right } if operator.ends_with('=') && !["==", "!=", "<=", ">="].contains(&operator.as_str()) => {
                self.out += "{ let r_ = ";
                self.copy(right.clone(), &edit.within);
                self.out += "; ";
                for (id, to) in &edit.mutants {
                    self.choice(*id, |w| {
                        w.copy(left.clone(), &edit.within);
                        w.out += &format!(" {to} r_;");
                    });
                    self.out += "else ";
                }
                self.out += "{ ";
                self.copy(left.clone(), &edit.within);
                self.out += &format!(" {operator} r_; }} }}");
            }
            Form::Binary { left, operator, right } => {
                let compares = ["==", "!=", "<=", ">=", "<", ">"].contains(&operator.as_str());
                let (by, place) = if compares { ("&", "*") } else { ("", "") };
                self.out += &format!("(match ({by}(");
                self.copy(left.clone(), &edit.within);
                self.out += &format!("), {by}(");
                self.copy(right.clone(), &edit.within);
                self.out += ")) { (l_, r_) => ";
                for (id, to) in &edit.mutants {
                    self.choice(*id, |w| w.out += &format!("{place}l_ {to} {place}r_"));
                    self.out += "else ";
                }
                self.out += &format!("{{ {place}l_ {operator} {place}r_ }} }})");
            }
            Form::Guard { guard, of_guard, of_arm } => {
                if guard.is_none() {
                    self.out += " if ";
                }
                self.out += "true";
                for (id, _) in of_arm {
                    self.out += &format!(" && !crate::switches::on({id})");
                }
                if let Some(guard) = guard {
                    self.out += " && (";
                    for (id, to) in of_guard {
                        let (not, or) = if to == "true" { ("", "||") } else { ("!", "&&") };
                        self.out += &format!("{not}crate::switches::on({id}) {or} (");
                    }
                    self.copy(guard.clone(), &edit.within);
                    self.out += &")".repeat(of_guard.len() + 1);
                }
            }
            Form::Field { path, name, value, rest } => {
                let id = edit.mutants[0].0;
                self.out += &format!("{name}: ");
                let base = self.source[rest.clone()].to_owned();
                self.choice(id, |w| w.out += &format!("let b_: {path} = {base}; b_.{name}"));
                self.out += "else { ";
                self.copy(value.clone(), &edit.within);
                self.out += " }";
            }
        }
        self.ranges.push((start..self.out.len(), edit.mutants.iter().map(|(id, _)| *id).collect()));
    }
}

/// A file with its switches, where they stand, and the mutants that have no place in it.
fn rewrite(source: &str, at: Places) -> (String, Vec<(Range<usize>, Vec<u64>)>, Vec<u64>) {
    let file = syn::parse_file(source).expect("Rust");
    let mut finder = Finder { source, at, edits: vec![], current: None, top: vec![] };
    finder.visit_file(&file);
    let unplaced = finder.at.values().flatten().map(|(id, _)| *id).collect();
    let mut writer = Writer { source, edits: &finder.edits, out: String::new(), ranges: vec![] };
    writer.copy(0..source.len(), &finder.top);
    (writer.out, writer.ranges, unplaced)
}

fn main() {
    let tree = std::env::args().nth(1).expect("switches TREE < MUTANTS");
    let mut text = String::new();
    stdin().read_to_string(&mut text).expect("mutants on the standard input");
    let mutants: Vec<Value> = serde_json::from_str(&text).expect("a list of mutants");
    let mut files: BTreeMap<String, Places> = BTreeMap::new();
    for m in &mutants {
        let start = &m["span"]["start"];
        let number = |name: &str| start[name].as_u64().unwrap_or(0) as usize;
        let place = (number("line"), number("column"), m["genre"].as_str().unwrap_or_default().to_owned());
        let entry = (m["id"].as_u64().expect("an id"), m["replacement"].as_str().unwrap_or_default().to_owned());
        files.entry(m["file"].as_str().expect("a file").to_owned()).or_default().entry(place).or_default().push(entry);
    }
    let (mut all, mut without) = (vec![], vec![]);
    for (name, at) in files {
        let path = Path::new(&tree).join(&name);
        let (out, ranges, unplaced) = rewrite(&fs::read_to_string(&path).expect("a source file"), at);
        all.extend(ranges.into_iter().map(|(range, ids)| json!({"file": name, "start": range.start, "end": range.end, "ids": ids})));
        without.extend(unplaced);
        fs::write(&path, out).expect("a file that can be written");
    }
    println!("{}", json!({"ranges": all, "unplaced": without}));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands at `needle` is changed into each of `to`.
    fn switched(kind: &str, source: &str, needle: &str, to: &[&str]) -> String {
        let column = source.find(needle).expect("it is there") + 1;
        let mutants = to.iter().zip(7..).map(|(to, id)| (id, (*to).to_owned())).collect();
        let (out, ranges, unplaced) = rewrite(source, BTreeMap::from([((1, column, kind.to_owned()), mutants)]));
        assert!(unplaced.is_empty() && ranges.iter().all(|(r, ids)| r.end <= out.len() && !ids.is_empty()));
        syn::parse_file(&out).expect("still Rust");
        out.replace("crate::switches::", "").split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn each_kind_of_mutant_has_its_switch() {
        for (kind, source, needle, to, expected) in [
            (
                "BinaryOperator",
                "fn f() -> f64 { a + b }",
                "+",
                vec!["-", "*"],
                "(match ((a), (b)) { (l_, r_) => if on(7) { l_ - r_ } else if on(8) { l_ * r_ } else { l_ + r_ } })",
            ),
            ("BinaryOperator", "fn f() -> bool { a < b }", "<", vec!["<="], "(match (&(a), &(b)) { (l_, r_) => if on(7) { *l_ <= *r_ } else { *l_ < *r_ } })"),
            ("BinaryOperator", "fn f() -> bool { a && b() }", "&&", vec!["||"], "(on(7) ^ ((on(7) ^ (a)) && (on(7) ^ (b()))))"),
            ("BinaryOperator", "fn f() { *a += 1.0; }", "+=", vec!["-="], "{ let r_ = 1.0; if on(7) { *a -= r_; } else { *a += r_; } }"),
            ("UnaryOperator", "fn f() -> f64 { -a }", "-a", vec![""], "(match a { l_ => if on(7) { l_ } else { - l_ } })"),
            ("FnValue", "fn f() -> u8 { g() }", "g()", vec!["0", "1"], "{if on(7) { return 0; } if on(8) { return 1; } g() }"),
            ("MatchArm", "fn f() { match x { A if g => 1, _ => 2 } }", "A", vec![""], "A if true && !on(7) && (g) => 1"),
            ("MatchArm", "fn f() { match x { A => 1, _ => 2 } }", "A", vec![""], "A if true && !on(7) => 1"),
            ("MatchArmGuard", "fn f() { match x { A if g => 1, _ => 2 } }", "g =>", vec!["true", "false"], "A if true && (on(7) || (!on(8) && (g))) => 1"),
            ("StructField", "fn f() -> S { S { a: 1, ..d() } }", "a: 1", vec![""], "S { a: if on(7) { let b_: S = d(); b_.a } else { 1 }, ..d() }"),
        ] {
            let found = switched(kind, source, needle, &to);
            assert!(found.contains(expected), "{source}: {found}");
        }
    }

    #[test]
    fn an_operator_within_an_operator_has_its_own() {
        let source = "fn f() -> f64 { a * (b + c) }";
        let at = [(19, 1, "/"), (24, 2, "-")].map(|(column, id, to)| ((1, column, "BinaryOperator".to_owned()), vec![(id, to.to_owned())])).into();
        let (out, _, _) = rewrite(source, at);
        assert!(out.contains("l_ / r_") && out.contains("l_ - r_") && out.contains("((match ((b), (c))"), "{out}");
    }
}
