//! Cut, damaged and hostile files: a right answer or an error, in bounded time and memory, never a panic.

use flate2::{Compression, FlushCompress};
use ndof_io::{IoError, ReadOptions, encode, formats, read_bytes};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::{Read, Write};

fn fixture(name: &str) -> Vec<u8> {
    std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)).expect(name)
}

/// 50 s at 500 Hz, two axes.
fn trial() -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut noise = |scale: f64| (0..25_000).map(|_| scale * rng.random_range(-1.0..1.0)).collect::<Vec<f64>>();
    let newton = Unit::si(Quantity::Effort, false);
    let metre = Unit::si(Quantity::Displacement, false);
    let channels = vec![
        Channel::new("force_x", newton.clone(), noise(10.0)),
        Channel::new("force_y", newton, noise(10.0)),
        Channel::new("pos_x", metre.clone(), noise(0.01)),
        Channel::new("pos_y", metre, noise(0.01)),
    ];
    Recording::new(500.0, channels).expect("valid")
}

/// The same as another program would write it: with a time column and nothing that counts the samples.
fn foreign_csv(recording: &Recording) -> Vec<u8> {
    let mut text = String::from("t [s]");
    recording.channels().iter().for_each(|c| text.push_str(&format!(",{} [{}]", c.name, c.unit)));
    for row in 0..recording.len() {
        text.push_str(&format!("\r\n{:.3}", row as f64 / recording.sample_rate_hz()));
        recording.channels().iter().for_each(|c| text.push_str(&format!(",{}", c.samples[row])));
    }
    text.push_str("\r\n");
    text.into_bytes()
}

/// The ends, where headers and last lines are, and random places between.
fn cuts(len: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    (0..400.min(len)).chain(len.saturating_sub(100)..len).chain((0..40).map(|_| rng.random_range(0..len))).collect()
}

#[test]
fn a_recording_cut_at_any_byte_is_its_beginning_or_an_error() {
    let whole = trial();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut answers = 0;
    for (file, bytes) in
        [("own.csv", encode(&whole, "own.csv").expect("csv")), ("foreign.csv", foreign_csv(&whole)), ("own.npz", encode(&whole, "own.npz").expect("npz"))]
    {
        for cut in cuts(bytes.len(), &mut rng) {
            match read_bytes(&bytes[..cut], file, &ReadOptions::default()) {
                Ok(read) => {
                    answers += 1;
                    assert_eq!(read.recording, whole.slice(0..read.recording.len()).expect("not longer"), "{file} cut at {cut}");
                }
                Err(error) => assert!(error.to_string().starts_with(file), "{file} cut at {cut}: {error}"),
            }
        }
    }
    // The foreign file has no count, so that a cut behind its first rows is a shorter recording.
    assert!(answers >= 50, "{answers}");
}

#[test]
fn a_cut_mat_file_has_fewer_channels_or_is_an_error() {
    for name in ["plain.mat", "struct_compressed.mat", "types.mat"] {
        let bytes = fixture(name);
        let whole = read_bytes(&bytes, name, &ReadOptions::default()).expect(name).recording;
        let options = ReadOptions { sample_rate_hz: Some(200.0), ..Default::default() };
        for cut in 0..bytes.len() {
            if let Ok(read) = read_bytes(&bytes[..cut], name, &options) {
                for channel in read.recording.channels() {
                    assert_eq!(channel, whole.channel(&channel.name).expect("known"), "{name} cut at {cut}");
                }
            }
        }
    }
}

/// Damaged copies of each file; `NDOF_FUZZ_ROUNDS=1200000` makes ten million of all.
fn rounds() -> usize {
    std::env::var("NDOF_FUZZ_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(5000)
}

#[test]
fn damaged_files_never_panic_and_stay_small() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let small = trial().slice(0..40).expect("inside");
    let mut files: Vec<(String, Vec<u8>)> = ["plain.npz", "time_deflated.npz", "types.npz", "plain.mat", "struct_compressed.mat", "types.mat", "expected.csv"]
        .map(|n| (n.to_owned(), fixture(n)))
        .into();
    if cfg!(feature = "hdf5") {
        files.extend(["group.h5", "v73.mat"].map(|n| (n.to_owned(), fixture(n))));
    }
    if cfg!(feature = "parquet") {
        files.extend(["pandas.parquet", "types.parquet"].map(|n| (n.to_owned(), fixture(n))));
    }
    for format in formats().iter().filter(|f| f.writes && f.built_in) {
        let file = format!("own.{}", format.suffixes[0]);
        files.push((file.clone(), encode(&small, &file).expect("written")));
    }
    let options =
        [ReadOptions::default(), ReadOptions { sample_rate_hz: Some(200.0), allow_nan: true, resample: Some(ndof_io::Resample::Auto), ..Default::default() }];
    for (file, bytes) in files {
        for round in 0..rounds() {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..damaged.len());
                match rng.random_range(0..5) {
                    0 => damaged[at] = rng.random_range(0..=255),
                    1 => damaged[at] ^= 1 << rng.random_range(0..8),
                    2 => {
                        damaged.remove(at);
                    }
                    3 => damaged.insert(at, [0, 255, b',', b'\n', b'"', b'9'][rng.random_range(0..6)]),
                    _ => {
                        // A length or a count that lies.
                        let end = damaged.len().min(at + 4);
                        damaged[at..end].fill([0, 0x7f, 0xff][rng.random_range(0..3)]);
                    }
                }
            }
            if let Ok(read) = read_bytes(&damaged, &file, &options[round % 2]) {
                assert!(read.recording.len() <= 16 * damaged.len(), "{file}: {}", read.recording);
            }
        }
    }
}

#[test]
fn noise_behind_every_magic_is_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for start in [&b""[..], b"PK\x03\x04", b"PK\x05\x06", b"MATLAB 5.0 MAT-file", b"PAR1", b"\x89HDF\r\n\x1a\n", b"a,b\n", b"t,b\n1,2\n"] {
        for _ in 0..500 {
            let mut bytes = start.to_vec();
            let len = rng.random_range(0..400);
            bytes.extend((0..len).map(|_| rng.random::<u8>()));
            if start.starts_with(b"MATLAB") {
                bytes.resize(bytes.len().max(200), 0);
                bytes[126..128].copy_from_slice(b"IM");
            }
            if start.starts_with(b"PAR1") {
                bytes.extend_from_slice(b"PAR1");
            }
            assert!(read_bytes(&bytes, "noise.csv", &ReadOptions::default()).is_err());
        }
    }
}

#[test]
fn a_million_columns_are_refused() {
    let names: String = (0..1_000_000).map(|k| format!("c{k},")).collect();
    let error = read_bytes(format!("{names}\n1\n").as_bytes(), "wide.csv", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::TooLarge { found: 1_000_000, .. }), "{error}");
    let error = read_bytes(format!("{}\n1\n", "a".repeat(10_000_000)).as_bytes(), "long.csv", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::TooLarge { .. }), "{error}");
}

/// A zlib stream that unpacks to `megabytes` MB of zeros, made of one packed megabyte again and again.
fn zlib_bomb(megabytes: usize) -> Vec<u8> {
    let mut packer = flate2::Compress::new(Compression::best(), true);
    let zeros = vec![0; 1 << 20];
    let mut pack = || {
        let mut out = Vec::with_capacity(1 << 16);
        packer.compress_vec(&zeros, &mut out, FlushCompress::Full).expect("packed");
        out
    };
    let (mut bomb, again) = (pack(), pack());
    (1..megabytes).for_each(|_| bomb.extend_from_slice(&again));
    bomb
}

fn mat_header() -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend_from_slice(&[0, 1, b'I', b'M']);
    bytes
}

#[test]
fn decompression_bombs_are_refused() {
    let bomb = zlib_bomb(2000);
    assert!(bomb.len() < 4 << 20);
    let mut mat = mat_header();
    mat.extend_from_slice(&15u32.to_le_bytes());
    mat.extend_from_slice(&(bomb.len() as u32).to_le_bytes());
    mat.extend_from_slice(&bomb);
    let error = read_bytes(&mat, "bomb.mat", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::TooLarge { .. }), "{error}");

    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    archive.start_file("force_x.npy", zip::write::SimpleFileOptions::default()).expect("entry");
    let zeros = vec![0; 1 << 20];
    (0..400).for_each(|_| archive.write_all(&zeros).expect("written"));
    let npz = archive.finish().expect("finished").into_inner();
    assert!(npz.len() < 1 << 20);
    let error = read_bytes(&npz, "bomb.npz", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::TooLarge { .. }), "{error}");
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut out = kind.to_le_bytes().to_vec();
    out.extend_from_slice(&(data.len() as u32).to_le_bytes());
    out.extend_from_slice(data);
    out.resize(out.len().next_multiple_of(8), 0);
    out
}

fn matrix(class: u32, sizes: [i32; 2], name: &[u8], rest: &[u8]) -> Vec<u8> {
    let mut data = element(6, &[class.to_le_bytes(), [0; 4]].concat());
    data.extend(element(5, &[sizes[0].to_le_bytes(), sizes[1].to_le_bytes()].concat()));
    data.extend(element(1, name));
    data.extend_from_slice(rest);
    element(14, &data)
}

#[test]
fn sizes_that_lie_and_bottomless_structs_are_refused() {
    let real = element(9, &[0; 16]);
    for sizes in [[1_000_000_000, 1], [i32::MAX, i32::MAX], [-1, 2], [3, 1]] {
        let bytes = [mat_header(), matrix(6, sizes, b"force_x", &real)].concat();
        let error = read_bytes(&bytes, "lie.mat", &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, IoError::Damaged { .. } | IoError::TooLarge { .. }), "{error}");
    }
    let mut inner = matrix(6, [2, 1], b"", &real);
    for _ in 0..2000 {
        let fields = [element(5, &2i32.to_le_bytes()), element(1, b"a\0"), inner].concat();
        inner = matrix(2, [1, 1], b"s", &fields);
    }
    let error = read_bytes(&[mat_header(), inner].concat(), "deep.mat", &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("nested"), "{error}");
}

/// A hundred million missing values take 260 kB in Parquet and would take 800 MB in memory.
#[cfg(feature = "parquet")]
#[test]
fn rows_that_take_no_room_in_parquet_are_refused() {
    use parquet::data_type::DoubleType;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;
    let schema = parse_message_type("message recording { OPTIONAL DOUBLE force_x; }").expect("schema");
    let mut writer = SerializedFileWriter::new(Vec::new(), schema.into(), Default::default()).expect("writer");
    let missing = vec![0i16; 1_000_000];
    for _ in 0..100 {
        let mut group = writer.next_row_group().expect("group");
        let mut column = group.next_column().expect("column").expect("one");
        column.typed::<DoubleType>().write_batch(&[], Some(&missing), None).expect("written");
        column.close().expect("closed");
        group.close().expect("closed");
    }
    let bytes = writer.into_inner().expect("finished");
    assert!(bytes.len() < 1_000_000, "{}", bytes.len());
    let error = read_bytes(&bytes, "bomb.parquet", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, IoError::TooLarge { .. }), "{error}");
}

#[test]
fn the_bomb_of_this_test_is_one() {
    let mut out = Vec::new();
    let stopped = flate2::read::ZlibDecoder::new(&zlib_bomb(3)[..]).read_to_end(&mut out);
    assert_eq!(out.len(), 3 << 20, "{stopped:?}");
}
