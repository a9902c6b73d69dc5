//! Writes the questions of an exam into a folder:
//! `cargo run --release -p ndof-challenge --example exam -- SET FOLDER [--threads N] [--only TEXT]`, where SET is quick, tuning, practice or final.
//! A question that is there already is left as it is.

use ndof_challenge::exam::{Set, paper, pose, write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|k| arguments.get(k + 1));
    let set = match arguments.first().map(String::as_str) {
        Some("quick") => Set::Quick,
        Some("tuning") => Set::Tuning,
        Some("practice") => Set::Practice,
        Some("final") => Set::Final,
        _ => return Err("which set: quick, tuning, practice or final".into()),
    };
    let folder = PathBuf::from(arguments.get(1).ok_or("which folder")?);
    let threads: usize = value("--threads").map_or(Ok(2), |n| n.parse())?;
    std::fs::create_dir_all(&folder)?;
    let asked = |q: &ndof_challenge::exam::Question| value("--only").is_none_or(|only| q.id.contains(only) || q.hidden.join(" ").contains(only));
    let questions: Vec<_> = paper(set).into_iter().filter(|q| asked(q) && !folder.join(format!("{}.truth.json", q.id)).exists()).collect();
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| -> std::io::Result<()> {
        let work = || -> std::io::Result<()> {
            while let Some(question) = questions.get(next.fetch_add(1, Ordering::Relaxed)) {
                write(&pose(question), &folder)?;
            }
            Ok(())
        };
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("a worker that ends"))
    })?;
    println!("{}: {} questions written to {}", set.word(), questions.len(), folder.display());
    Ok(())
}
