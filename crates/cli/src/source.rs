//! Bytes that arrive while a trial runs: standard input, or a file that grows.

use crate::error::CliError;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Bytes taken at once.
const CHUNK: usize = 1 << 16;
/// Chunks that wait before the writer has to.
const WAITING: usize = 64;

/// What came.
#[derive(Debug)]
pub enum Arrival {
    /// Bytes.
    Bytes(Vec<u8>),
    /// Nothing within the time allowed.
    Nothing,
    /// There will be no more.
    End,
}

/// Where samples come from.
pub struct Source {
    name: String,
    kind: Kind,
}

enum Kind {
    Pipe(Receiver<std::io::Result<Vec<u8>>>),
    Growing(File),
}

impl Source {
    /// Opens a file, or standard input for `-`.
    pub fn open(path: &Path) -> Result<Self, CliError> {
        if path.as_os_str() == "-" {
            return Ok(Source { name: "standard input".to_owned(), kind: Kind::Pipe(pipe()) });
        }
        ndof_io::keep(path);
        let name = path.display().to_string();
        let failed = |source| CliError::Io(ndof_io::IoError::Read { file: name.clone(), source });
        let file = File::open(path).map_err(failed)?;
        if file.metadata().map_err(failed)?.is_dir() {
            return Err(failed(std::io::ErrorKind::IsADirectory.into()));
        }
        Ok(Source { name, kind: Kind::Growing(file) })
    }

    /// What messages call it.
    pub fn name(&self) -> String {
        self.name.clone()
    }

    /// Whether it has no end of its own.
    pub fn grows(&self) -> bool {
        matches!(self.kind, Kind::Growing(_))
    }

    /// The next bytes, waiting at most `time`.
    pub fn next(&mut self, time: Duration) -> Result<Arrival, CliError> {
        let failed = |source| CliError::Io(ndof_io::IoError::Read { file: self.name.clone(), source });
        match &mut self.kind {
            Kind::Pipe(receiver) => match receiver.recv_timeout(time) {
                Ok(bytes) => bytes.map(Arrival::Bytes).map_err(failed),
                Err(RecvTimeoutError::Timeout) => Ok(Arrival::Nothing),
                Err(RecvTimeoutError::Disconnected) => Ok(Arrival::End),
            },
            Kind::Growing(file) => {
                let mut bytes = vec![0; CHUNK];
                let count = file.read(&mut bytes).map_err(failed)?;
                if count == 0 {
                    std::thread::sleep(time);
                    return Ok(Arrival::Nothing);
                }
                bytes.truncate(count);
                Ok(Arrival::Bytes(bytes))
            }
        }
    }
}

/// Standard input, read by a thread of its own so that Ctrl-C is heard while nothing comes.
fn pipe() -> Receiver<std::io::Result<Vec<u8>>> {
    let (sender, receiver) = sync_channel(WAITING);
    std::thread::spawn(move || {
        let mut stdin = std::io::stdin().lock();
        loop {
            let mut bytes = vec![0; CHUNK];
            let result = match stdin.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => {
                    bytes.truncate(count);
                    Ok(bytes)
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => Err(error),
            };
            let failed = result.is_err();
            if sender.send(result).is_err() || failed {
                return;
            }
        }
    });
    receiver
}
