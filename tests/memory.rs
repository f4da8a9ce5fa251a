//! The memory that reading a file takes depends on what the file contains, not on its length and not on a size that it
//! claims. These tests count the memory in the allocator. The files are generated while they are read, so that
//! gigabytes need no disk: `HBAO_JUNK_MB=2048 cargo test --test memory -- --nocapture` reads 2 GB of each kind.

#[path = "rig/random.rs"]
#[allow(dead_code, unreachable_pub)]
mod random;

use hbao::Error;
use hbao::image::{exr, png};
use hbao::scene::{Mesh, Scene};
use random::Draw;
use std::alloc::{GlobalAlloc, Layout, System};
use std::ffi::OsStr;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn more(size: usize) {
    let held = HELD.fetch_add(size, Ordering::Relaxed) + size;
    PEAK.fetch_max(held, Ordering::Relaxed);
}

// SAFETY: each call is passed on to the system allocator, with the promises that the caller has made.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // The old block may exist beside the new one for a while. Large blocks are moved by remapping their pages.
        more(size);
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(old, layout, size) }
    }
}

/// Makes the tests run one at a time, because they share the counters.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the largest number of bytes that `work` holds at once, and what `work` returns.
fn peak<T>(work: impl FnOnce() -> T) -> (usize, T) {
    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let result = work();
    (PEAK.load(Ordering::Relaxed) - before, result)
}

const MB: usize = 1 << 20;

/// A stream of the bytes in `first`, followed by about `length` more bytes: `over` repeated, or random bytes if `over`
/// is empty.
struct Junk {
    first: Vec<u8>,
    over: Vec<u8>,
    at: usize,
    left: usize,
    draw: Draw,
}

impl Junk {
    fn new(first: &[u8], over: &[u8], length: usize) -> BufReader<Junk> {
        BufReader::new(Junk {
            first: first.into(),
            over: over.into(),
            at: 0,
            left: length - length % over.len().max(1),
            draw: Draw::new(1),
        })
    }
}

impl Read for Junk {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = buffer.len().min(self.left);
        let source = if self.at < self.first.len() { &self.first[self.at..] } else { &[] };
        if !source.is_empty() {
            let length = length.min(source.len());
            buffer[..length].copy_from_slice(&source[..length]);
            self.at += length;
            return Ok(length);
        }
        for byte in &mut buffer[..length] {
            *byte = if self.over.is_empty() {
                // The first letters of the shortest statements are left out, because one such statement would soon end
                // the reading.
                match self.draw.below(256) as u8 {
                    b'v' | b'f' | b'K' => b'_',
                    byte => byte,
                }
            } else {
                let byte = self.over[self.at % self.over.len()];
                self.at += 1;
                byte
            };
        }
        self.left -= length;
        Ok(length)
    }
}

/// Returns the one-line message that says why there is no model.
fn refusal(kind: &str, result: Result<(Mesh, Vec<String>), Error>) -> String {
    let Err(error) = result else { panic!("{kind}: accepted as a model") };
    let message = error.to_string();
    assert!(message.len() < 300 && !message.chars().any(char::is_control), "{kind}: {message:?}");
    message
}

const TRIANGLE: &str = "mtllib m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";

#[test]
fn gigabytes_of_junk_end_in_one_line_and_leave_no_trace_in_memory() {
    let _alone = alone();
    let length = MB * std::env::var("HBAO_JUNK_MB").map_or(32, |mb| mb.parse::<usize>().unwrap());
    // An unfinished line takes at most 2 MiB, three times that if its bytes are not UTF-8, and as much again while it
    // grows.
    let (short, long) = (MB, 24_000_000);
    let ended = [b"\xff".repeat(2 * MB - 1), b"\n".to_vec()].concat();
    let continued = [b"\xff".repeat(2 * MB - 2), b"\\\n".to_vec()].concat();
    type Kind<'a> = (&'a str, &'a [u8], &'a [u8], usize, &'a str);
    let kinds: [Kind; 14] = [
        ("lines of no text", b"", &ended, long, "holds no faces"),
        ("continued lines of no text", b"", &continued, long, "line 1: more than 2097152 bytes"),
        ("random bytes", b"", b"", short, "holds no faces"),
        ("lines that end with carriage returns", b"", b"foo\r", short, "holds no faces"),
        ("zeros", b"", b"\0", long, "line 1: more than 2097152 bytes"),
        ("one line of text", b"", b"v 0 0 0 ", long, "line 1: more than 2097152 bytes"),
        ("one line of no text", b"", b"\xff", long, "line 1: more than 2097152 bytes"),
        ("one comment", b"#", b" ", long, "line 1: more than 2097152 bytes"),
        ("line ends", b"", b"\n", short, "holds no faces"),
        ("unknown statements", b"", b"foo 1 2 3\n", short, "holds no faces"),
        ("points and lines", b"v 0 0 0\n", b"p 1\nl 1 1\nf 1\nf 1 1\n", short, "holds no faces"),
        ("continued lines", b"", b"v 0 0 0 \\\n", long, "line 1: more than 2097152 bytes"),
        ("materials in turn", b"", b"usemtl a\nusemtl b\nmtllib m\n", short, "holds no faces"),
        ("a vertex, then an index", b"v 0 0 0\nf 1 1 2\n", b"", short, "line 2: index 2"),
    ];
    let no_material = |_: &OsStr| Err::<&[u8], _>(io::ErrorKind::NotFound.into());
    for (kind, first, over, most, what) in kinds {
        let read = || Mesh::read_obj(Junk::new(first, over, length), Path::new("m.obj"), no_material);
        let (peak, message) = peak(|| refusal(kind, read()));
        println!("{} MB of {kind}: {peak} bytes held, {message}", length / MB);
        assert!(message.contains(what), "{kind}: {message}");
        assert!(peak < most, "{kind}: {peak} bytes held");
    }
    // These are left out of a model, with one notice of each kind.
    let kinds: [(&str, &[u8], &[u8], &str); 3] = [
        ("random bytes", TRIANGLE.as_bytes(), b"", "m.obj: line 1: material file \"m\" cannot be read"),
        ("corners without their normals", b"v 0 0 0\nf 1 1 1\n", b"f 1//9 1//9\n", "m.obj: line 4: index 9 "),
        ("bad normals of no place", b"v 0 0 0\nf 1 1 1\n", b"f 1//x 1\n", "m.obj: line 4: \"1//x\" "),
    ];
    for (kind, first, over, what) in kinds {
        let read = || Mesh::read_obj(Junk::new(first, over, length), Path::new("m.obj"), no_material);
        let (peak, result) = peak(read);
        let (_, notices) = result.unwrap_or_else(|error| panic!("{kind}: {error}"));
        println!("a model, then {} MB of {kind}: {peak} bytes held, {notices:?}", length / MB);
        // The junk has faces of two corners, which are told in a notice of their own.
        assert!(notices.len() <= 2 && notices.iter().any(|notice| notice.starts_with(what)), "{kind}: {notices:?}");
        assert!(peak < short, "{kind}: {peak} bytes held");
    }
    let kinds: [(&str, &[u8], usize, &[&str]); 6] = [
        ("random bytes", b"", short, &["m.obj: line 5: no material file defines \"a\""]),
        ("zeros", b"\0", long, &["m: line 1: more than 2097152 bytes"]),
        ("line ends", b"\n", short, &["m.obj: line 5: no material file defines \"a\""]),
        ("unknown statements", b"illum 2\n", short, &["m.obj: line 5: "]),
        ("materials of no use", b"newmtl b\nKd 1 1 1\nnewmtl cc\n", short, &["m.obj: line 5: "]),
        (
            "colours of no use",
            b"Kd x\n",
            short,
            &["m: line 1: \"x\" is not a number (the first of ", "m.obj: line 5: "],
        ),
    ];
    for (kind, over, most, expected) in kinds {
        let read = || Mesh::read_obj(TRIANGLE.as_bytes(), Path::new("m.obj"), |_| Ok(Junk::new(b"", over, length)));
        let (peak, result) = peak(read);
        println!("{} MB of {kind} as materials: {peak} bytes", length / MB);
        let (_, notices) = result.unwrap_or_else(|error| panic!("{kind}: {error}"));
        let told = notices.iter().zip(expected).all(|(notice, start)| notice.starts_with(start));
        assert!(told && notices.len() == expected.len(), "{kind}: {notices:?}");
        assert!(peak < most, "{kind}: {peak} bytes held");
    }
}

#[test]
fn a_model_takes_few_bytes_for_each_of_its_file() {
    let _alone = alone();
    let (most, mut worst) = (40.0, 0.0_f64);
    // A list doubles its capacity when it is full, and takes the most memory for its content just after that. Each list
    // does this at another length of the file, but all of them do it between a length and twice that length. The longer
    // run, which HBAO_JUNK_MB asks for, tries four times as many lengths.
    let every = if std::env::var_os("HBAO_JUNK_MB").is_some() { 1 } else { 4 };
    for length in (32..64).step_by(every).map(|part| part * MB / 32) {
        for (kind, text) in models_of_little_but_one_thing(length) {
            let mtl: &[u8] = b"newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n";
            let (peak, mesh) = peak(|| Mesh::read_obj(text.as_bytes(), Path::new("m.obj"), |_| Ok(mtl)));
            mesh.unwrap_or_else(|error| panic!("{kind}: {error}"));
            let each = peak as f64 / text.len() as f64;
            worst = worst.max(each);
            assert!(each < most, "{kind}: {each} bytes of memory per byte of the file");
        }
    }
    println!("at worst {worst:.2} bytes for each of the file");
}

#[test]
fn junk_in_other_formats_ends_in_one_line_and_leaves_no_trace_in_memory() {
    let _alone = alone();
    let length = MB * std::env::var("HBAO_JUNK_MB").map_or(32, |mb| mb.parse::<usize>().unwrap());
    let (short, long) = (MB, 24_000_000);
    let ply = b"ply\nformat ascii 1.0\n";
    let claim = b"ply\nformat binary_little_endian 1.0\nelement junk 18446744073709551615\nproperty list uint int a\nend_header\n";
    let points = b"ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nproperty int x\nend_header\n";
    type Kind<'a> = (&'a str, &'a [u8], &'a [u8], usize, &'a str);
    let kinds: [Kind; 10] = [
        ("comments of PLY", ply, b"comment \n", short, "before end_header"),
        ("one line of PLY", ply, b"comment ", long, "line 3: more than 2097152 bytes"),
        ("records of PLY that are skipped", claim, b"\x01\0\0\0abcd", short, "cut short"),
        ("vertices of PLY without places", points, b"0\n", short, "lacks a property x"),
        ("statements of STL", b"solid\nfacet\nendsolid\n", b"outer loop\n", short, "cut short"),
        ("one line of STL", b"solid\nfacet\n", b"a ", long, "more than 2097152 bytes"),
        ("white space of JSON", b"{\"asset\":{\"version\":\"2.0\"}", b" \n", short, "no glTF 2"),
        ("brackets of JSON", b"{\"asset\":{\"version\":\"2.0\"},\"extras\":", b"[", short, "no glTF 2"),
        (
            "members of JSON that are skipped",
            b"{\"asset\":{\"version\":\"2.0\"},\"extras\":[0",
            b",{\"a\":[1]}",
            short,
            "no glTF 2",
        ),
        ("a GLB part", b"glTF\x02\0\0\0\xff\xff\xff\xff\xf0\xff\xff\x1fJSON{\"extras\":[0", b",0", short, "no glTF 2"),
    ];
    for (kind, first, over, most, what) in kinds {
        // What is repeated begins after what is first.
        let mut over = over.to_vec();
        let shift = first.len() % over.len();
        over.rotate_right(shift);
        let read =
            || Scene::read(Junk::new(first, &over, length), Path::new("m")).map(|scene| (scene.mesh, scene.notices));
        let (peak, message) = peak(|| refusal(kind, read()));
        println!("{} MB of {kind}: {peak} bytes held, {message}", length / MB);
        assert!(message.contains(what), "{kind}: {message}");
        assert!(peak < most, "{kind}: {peak} bytes held");
    }
}

#[test]
fn a_model_of_another_format_takes_few_bytes_for_each_of_its_file() {
    let _alone = alone();
    let (most, mut worst) = (40.0, 0.0_f64);
    let ply = |vertices: usize, properties: &str, faces: usize| {
        let properties: String = properties.split(' ').map(|name| format!("property uchar {name}\n")).collect();
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{properties}element face {faces}\n\
             property list ushort uchar vertex_indices\nend_header\n"
        )
        .into_bytes()
    };
    for length in (32..64).step_by(4).map(|part| part * MB / 32) {
        let vertices = |properties: &str, each: usize| {
            [ply(length / each, properties, 1), vec![1; length / each * each], vec![3, 0, 0, 1, 2]].concat()
        };
        let polygon = [b"\xff\xff".as_slice(), &[1; 65_535]].concat();
        let facet = |i: usize| {
            let corner = |j: usize| [(3 * i + j) as f32, (j * j) as f32, 1.0].map(f32::to_le_bytes).concat();
            [vec![0; 12], corner(0), corner(1), corner(2), vec![0; 2]].concat()
        };
        let count = length / 50;
        let stl =
            [vec![b' '; 80], (count as u32).to_le_bytes().to_vec(), (1..=count).flat_map(facet).collect()].concat();
        let files = [
            ("positions", vertices("x y z", 3)),
            ("normals", vertices("x y z nx ny nz", 6)),
            ("colours", vertices("x y z nx ny nz red green blue", 9)),
            ("triangles", [ply(1, "x y z", length / 5), vec![1; 3], [3, 0, 0, 0, 0].repeat(length / 5)].concat()),
            ("polygons", [ply(2, "x y z", length / 65_537), vec![1; 6], polygon.repeat(length / 65_537)].concat()),
            ("STL", stl),
        ];
        for (kind, bytes) in files {
            let (peak, scene) = peak(|| Scene::read(bytes.as_slice(), Path::new("m")));
            scene.unwrap_or_else(|error| panic!("{kind}: {error}"));
            let each = peak as f64 / bytes.len() as f64;
            println!("{kind}: {each:.2}");
            worst = worst.max(each);
            assert!(each < most, "{kind}: {each} bytes of memory per byte of the file");
        }
    }
    println!("at worst {worst:.2} bytes for each of the file");
}

/// The models that take the most memory, in files of about `length` bytes.
fn models_of_little_but_one_thing(length: usize) -> [(&'static str, String); 14] {
    let repeated = |head: &str, over: &str| format!("{head}{}", over.repeat(length / over.len()));
    let counted = |head: &str, next: &dyn Fn(usize) -> String| {
        let mut text = head.to_string();
        (1..)
            .map(next)
            .take_while(|next| {
                text += next;
                text.len() < length
            })
            .for_each(drop);
        text
    };
    let polygon = format!("f{}\n", " 1".repeat(65_536));
    [
        ("positions", repeated("v 0 0 0\nf 1 1 1\n", "v 0 0 0\n")),
        ("normals", repeated("v 0 0 0\nf 1 1 1\n", "vn 0 0 1\n")),
        ("triangles", repeated("v 0 0 0\n", "f 1 1 1\n")),
        ("polygons", repeated("v 0 0 0\n", &polygon)),
        ("polygons of coloured vertices", repeated("v 0 0 0 1 0 0\nvt 0 0\nvn 0 0 1\n", &polygon)),
        ("coloured positions", repeated("v 0 0 0\nf 1 1 1\n", "v 0 0 0 1 0 0\n")),
        ("vertices with texture coordinates", counted("v 0 0 0\n", &|i| format!("vt 0 0\nf 1/{i} 1/{i} 1/{i}\n"))),
        ("colours in turn", repeated("mtllib m\nv 0 0 0\n", "usemtl a\nf 1 1 1\nusemtl b\nf 1 1 1\n")),
        ("textures in turn", repeated("v 0 0 0\nvt 0 0\nusemtl a\n", "f 1/1 1/1 1/1\nf 1 1 1\n")),
        ("bad texture coordinates", repeated("v 0 0 0\nf 1 1 1\n", "vt\n")),
        ("materials", counted("v 0 0 0\n", &|i| format!("usemtl {i}\nf 1 1 1\n"))),
        ("names of materials", counted("v 0 0 0\nf 1 1 1\n", &|i| format!("usemtl {i}\n"))),
        ("vertices", counted("", &|i| format!("v 0 0 0\nf {i} {i} {i}\n"))),
        ("vertices with normals", counted("v 0 0 0\n", &|i| format!("vn 0 0 1\nf 1//{i} 1//{i} 1//{i}\n"))),
    ]
}

#[test]
fn a_picture_takes_no_memory_for_what_it_claims() {
    let _alone = alone();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile/pictures");
    let mut bombs = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let (peak, text) = peak(|| if name.ends_with("png") { png::read_text(&path) } else { exr::read_text(&path) });
        println!("{name}: {peak} bytes");
        assert!(peak < 50 * MB, "{name}: {peak} bytes held");
        if name.starts_with("1_bombs") {
            bombs += 1;
            assert!(text.unwrap_err().to_string().contains("past 16 MiB"));
        }
    }
    assert!(bombs > 0);
}
