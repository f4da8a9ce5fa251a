//! Files that are written to disk can be read by other programs, say what made them, and are written completely or not
//! at all.

use std::fs;
use std::path::{Path, PathBuf};

use hbao::Error;
use hbao::image::{Image, Outputs, exr, metadata, png};

const SETTINGS: &str = "method = \"hbao\"\nradius = 0.25\nscene = \"Käfig – 鳥かご.obj\"\n";

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder to write to")
}

/// Returns the sorted names of the entries of a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("a name")).collect();
    names.sort();
    names
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut outputs = Outputs::new();
    outputs.stage(path, bytes)?;
    outputs.commit()
}

/// Returns the message of an error, which must be about writing or reading and must be one line.
fn message<T>(result: Result<T, Error>) -> String {
    let error = result.err().expect("this must not succeed");
    assert!(matches!(error, Error::Output { .. } | Error::Input { .. }), "{error:?}");
    let message = error.to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

/// An image in which every value differs from its neighbours, and from those of the image upside down.
fn ramp() -> Image<u8> {
    Image::from_fn(5, 3, |x, y| (10 * x + 100 * y) as u8)
}

fn rgb_ramp() -> Image<[u8; 3]> {
    Image::from_fn(3, 4, |x, y| [x as u8, y as u8, 200 + (x + 3 * y) as u8])
}

/// Values that a conversion or a lossy codec would change: infinity as on background, zeros of both signs, the smallest
/// and the largest numbers, and thirds.
fn awkward_floats() -> Image<f32> {
    let values = [f32::INFINITY, -0.0, 0.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, -f32::MAX, 1.0 / 3.0, -1e17];
    Image::from_fn(37, 50, |x, y| values[(x + 5 * y) % values.len()])
}

mod images {
    use super::*;

    #[test]
    fn png_has_the_top_row_first() {
        let folder = folder();
        let (grey, rgb) = (folder.path().join("grey.png"), folder.path().join("rgb.png"));
        write(&grey, &png::encode(&ramp(), &[]).unwrap()).unwrap();
        write(&rgb, &png::encode(&rgb_ramp(), &[]).unwrap()).unwrap();

        let seen = image::open(&grey).unwrap();
        assert_eq!(seen.color(), image::ColorType::L8);
        let seen = seen.into_luma8();
        assert_eq!(seen.dimensions(), (5, 3));
        for (x, row, pixel) in seen.enumerate_pixels() {
            assert_eq!(pixel.0, [ramp().at(x as usize, 2 - row as usize)]);
        }
        let seen = image::open(&rgb).unwrap();
        assert_eq!(seen.color(), image::ColorType::Rgb8);
        for (x, row, pixel) in seen.into_rgb8().enumerate_pixels() {
            assert_eq!(pixel.0, rgb_ramp().at(x as usize, 3 - row as usize));
        }
    }

    #[test]
    fn exr_has_the_top_row_first() {
        let folder = folder();
        let path = folder.path().join("normals.exr");
        let normals = Image::from_fn(3, 20, |x, y| [x as f32, y as f32, -0.1]);
        write(&path, &exr::encode(&normals, &[]).unwrap()).unwrap();

        let seen = image::open(&path).unwrap();
        assert_eq!(seen.color(), image::ColorType::Rgb32F);
        for (x, row, pixel) in seen.into_rgb32f().enumerate_pixels() {
            assert_eq!(pixel.0, normals.at(x as usize, 19 - row as usize));
        }
    }

    #[test]
    fn png_reads_back_what_was_written() {
        let folder = folder();
        let path = folder.path().join("image.png");
        write(&path, &png::encode(&ramp(), &[]).unwrap()).unwrap();
        assert_eq!(png::read::<u8>(&path).unwrap(), ramp());
        assert!(message(png::read::<[u8; 3]>(&path)).contains("a PNG in Rgb of 8 bits"));
        write(&path, &png::encode(&rgb_ramp(), &[]).unwrap()).unwrap();
        assert_eq!(png::read::<[u8; 3]>(&path).unwrap(), rgb_ramp());
    }

    #[test]
    fn exr_keeps_every_bit() {
        let folder = folder();
        let path = folder.path().join("depth.exr");
        let bits = |image: &Image<f32>| image.map(f32::to_bits);
        for depth in [awkward_floats(), Image::filled(1, 1, f32::INFINITY)] {
            write(&path, &exr::encode(&depth, &[]).unwrap()).unwrap();
            assert_eq!(bits(&exr::read(&path).unwrap()), bits(&depth));
        }
        assert!(message(exr::read::<[f32; 3]>(&path)).contains("channel R, but the file has Y"));

        let normals = awkward_floats().map(|z| [z, -z, 0.5 * z]);
        write(&path, &exr::encode(&normals, &[]).unwrap()).unwrap();
        let seen = exr::read::<[f32; 3]>(&path).unwrap();
        assert_eq!(seen.map(|n| n.map(f32::to_bits)), normals.map(|n| n.map(f32::to_bits)));
    }

    #[test]
    fn the_same_image_is_the_same_file() {
        let text = metadata(SETTINGS);
        assert_eq!(exr::encode(&awkward_floats(), &text).unwrap(), exr::encode(&awkward_floats(), &text).unwrap());
        assert_eq!(png::encode(&ramp(), &text).unwrap(), png::encode(&ramp(), &text).unwrap());
    }

    #[test]
    fn a_file_says_what_made_it() {
        let folder = folder();
        let (png_path, exr_path) = (folder.path().join("ao.png"), folder.path().join("ao.exr"));
        write(&png_path, &png::encode(&ramp(), &metadata(SETTINGS)).unwrap()).unwrap();
        write(&exr_path, &exr::encode(&awkward_floats(), &metadata(SETTINGS)).unwrap()).unwrap();

        let software = concat!("hbao ", env!("CARGO_PKG_VERSION"));
        let pair = |keyword: &str, text: &str| (keyword.to_string(), text.to_string());
        assert_eq!(png::read_text(&png_path).unwrap(), [pair("Software", software), pair("hbao", SETTINGS)]);
        assert_eq!(exr::read_text(&exr_path).unwrap(), [pair("software", software), pair("hbao", SETTINGS)]);
    }

    #[test]
    fn an_image_without_pixels_is_refused() {
        for (width, height) in [(0, 0), (0, 3), (3, 0)] {
            assert!(png::encode(&Image::filled(width, height, 0u8), &[]).unwrap_err().is_usage());
            assert!(exr::encode(&Image::filled(width, height, 0f32), &[]).unwrap_err().is_usage());
        }
    }

    #[test]
    fn a_damaged_file_is_an_error() {
        let folder = folder();
        let path = folder.path().join("damaged");
        let place = |bytes: &[u8]| fs::write(&path, bytes).unwrap();
        let png = png::encode(&ramp(), &[("hbao", "radius = 1")]).unwrap();
        let exr = exr::encode(&Image::from_fn(5, 3, |x, y| (x * y) as f32), &[("hbao", "radius = 1")]).unwrap();
        for (file, is_png) in [(png, true), (exr, false)] {
            let read = |bytes: &[u8]| {
                place(bytes);
                // The text comes first and does not need the pixels. It is only required that reading it does not
                // panic.
                if is_png {
                    drop(png::read_text(&path));
                    png::read::<u8>(&path).map(drop)
                } else {
                    drop(exr::read_text(&path));
                    exr::read::<f32>(&path).map(drop)
                }
            };
            read(&file).unwrap();
            // A PNG ends with 12 bytes (IEND). Without them its pixels are still complete.
            let needed = if is_png { file.len() - 12 } else { file.len() };
            for length in 0..needed {
                assert!(read(&file[..length]).is_err(), "{length} bytes of {} were taken for an image", file.len());
            }
            for place in 0..file.len() {
                for damage in [0x01, 0x80, 0xff] {
                    let mut file = file.clone();
                    file[place] ^= damage;
                    drop(read(&file)); // not all damage is detected, but none may cause a panic
                }
            }
        }
        assert!(message(png::read::<u8>(&folder.path().join("absent.png"))).contains("absent.png: no such file"));
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused_before_memory_is_set_aside() {
        let folder = folder();
        let path = folder.path().join("claims");
        // The header of an EXR has its size in `dataWindow`: name, type and length, then left, top, right and bottom.
        let mut bytes = exr::encode(&Image::filled(4, 4, 1f32), &[]).unwrap();
        let field = b"dataWindow\0box2i\0\x10\0\0\0";
        let place = bytes.windows(field.len()).position(|window| window == field).unwrap() + field.len();
        bytes[place + 8..place + 12].copy_from_slice(&100_000_000i32.to_le_bytes());
        fs::write(&path, &bytes).unwrap();
        assert!(message(exr::read::<f32>(&path)).contains("claims 1600000016 bytes"));

        // The header of a PNG has a checksum, so it is written by the crate that writes PNG files.
        let mut bytes = Vec::new();
        drop(::png::Encoder::new(&mut bytes, 1 << 30, 1 << 30).write_header());
        fs::write(&path, &bytes).unwrap();
        assert!(message(png::read::<u8>(&path)).contains("claims 1152921504606846976 bytes"));
    }
}

mod files {
    use super::*;

    #[test]
    fn all_appear_together() {
        let folder = folder();
        let (one, two) = (folder.path().join("one"), folder.path().join("two"));
        fs::write(&two, "old").unwrap();
        let mut outputs = Outputs::new();
        outputs.stage(&one, b"1").unwrap();
        outputs.stage(&two, b"2").unwrap();
        assert!(!one.exists());
        assert_eq!(fs::read(&two).unwrap(), b"old");
        outputs.commit().unwrap();
        assert_eq!(names(folder.path()), ["one", "two"]);
        assert_eq!((fs::read(&one).unwrap(), fs::read(&two).unwrap()), (b"1".to_vec(), b"2".to_vec()));
    }

    #[test]
    fn nothing_is_left_without_a_commit() {
        let folder = folder();
        let mut outputs = Outputs::new();
        outputs.stage(folder.path().join("one"), b"1").unwrap();
        assert_eq!(names(folder.path()).len(), 1);
        drop(outputs);
        assert!(names(folder.path()).is_empty());

        Outputs::check([folder.path().join("one"), folder.path().join("two")]).unwrap();
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn nothing_is_left_after_a_failure() {
        let folder = folder();
        let mut outputs = Outputs::new();
        outputs.stage(folder.path().join("one"), b"1").unwrap();
        outputs.stage(folder.path().join("absent/two"), b"2").unwrap_err();
        drop(outputs);
        assert!(names(folder.path()).is_empty());

        // A folder that takes the name between staging and commit makes the rename fail.
        let name = folder.path().join("three");
        let mut outputs = Outputs::new();
        outputs.stage(&name, b"3").unwrap();
        fs::create_dir(&name).unwrap();
        assert!(message(outputs.commit()).starts_with("cannot write"));
        assert_eq!(names(folder.path()), ["three"]);
    }

    #[test]
    fn a_destination_that_cannot_be_is_explained() {
        let folder = folder();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let check = |path: PathBuf| message(Outputs::check([path]));
        let absent = folder.path().join("absent");
        assert!(check(absent.join("x.png")).ends_with("absent does not exist: create it first"));
        assert!(check(folder.path().into()).ends_with("it is a folder: name a file"));
        assert!(check(folder.path().join("sub/")).ends_with("it is the name of a folder: add the name of a file"));
        assert!(check(absent.join("..")).ends_with("it does not end with the name of a file: add one"));
        assert!(check(PathBuf::new()).ends_with("it does not end with the name of a file: add one"));
        assert!(check(file.join("x.png")).ends_with("file is not a folder"));
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn one_name_for_two_outputs_is_an_error() {
        let folder = folder();
        let [name, spelled_otherwise] = ["x.png", "./x.png"].map(|name| folder.path().join(name));
        assert!(message(Outputs::check([name, spelled_otherwise])).contains("two outputs have this name"));
    }

    #[test]
    fn a_name_without_a_folder_is_in_the_current_one() {
        Outputs::check(["hbao-no-such-file.png"]).unwrap();
        assert!(!Path::new("hbao-no-such-file.png").exists());
    }

    #[test]
    fn a_read_only_file_is_not_replaced() {
        let folder = folder();
        let file = folder.path().join("file");
        fs::write(&file, "precious").unwrap();
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        assert!(message(write(&file, b"new")).contains("read-only"));
        assert_eq!(fs::read(&file).unwrap(), b"precious");
    }
}

#[cfg(unix)]
mod unix_files {
    use super::*;
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
    use std::process::Command;

    /// The mode is compared with that of a file which this process makes itself, because the umask depends on who runs
    /// the tests.
    #[test]
    fn permissions_follow_the_umask() {
        let folder = folder();
        let (plain, ours) = (folder.path().join("plain"), folder.path().join("ours"));
        fs::write(&plain, "").unwrap();
        write(&ours, b"").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn a_read_only_folder_is_an_error() {
        let folder = folder();
        let set = |mode| fs::set_permissions(folder.path(), fs::Permissions::from_mode(mode)).unwrap();
        set(0o555);
        // Permissions do not bind root, who may write here nonetheless. The next test holds for root too.
        let bound = fs::write(folder.path().join("probe"), "").is_err();
        let result = write(&folder.path().join("x.png"), b"");
        set(0o755);
        if bound {
            assert!(message(result).contains(": Permission denied"));
            assert!(names(folder.path()).is_empty());
        } else {
            result.unwrap();
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_takes_files_from_nobody_is_an_error() {
        assert!(message(Outputs::check(["/proc/x.png"])).contains("no file can be created in /proc"));
    }

    #[test]
    fn a_symbolic_link_stays_and_its_target_is_replaced() {
        let folder = folder();
        let place = |name: &str| folder.path().join(name);
        fs::create_dir(place("sub")).unwrap();
        fs::write(place("sub/target"), "old").unwrap();
        symlink("sub/target", place("link")).unwrap();
        symlink("link", place("link to link")).unwrap();
        symlink("sub/absent", place("dangling")).unwrap();
        write(&place("link to link"), b"new").unwrap();
        write(&place("dangling"), b"made").unwrap();
        assert_eq!(fs::read(place("sub/target")).unwrap(), b"new");
        assert_eq!(fs::read(place("sub/absent")).unwrap(), b"made");
        assert_eq!(names(folder.path()), ["dangling", "link", "link to link", "sub"]);
        assert_eq!(names(&place("sub")), ["absent", "target"]);
        assert!(["link", "link to link", "dangling"].iter().all(|link| place(link).is_symlink()));

        assert!(message(Outputs::check([place("link"), place("sub/target")])).contains("two outputs"));
        symlink("loop", place("loop")).unwrap();
        assert!(message(Outputs::check([place("loop")])).contains("too many symbolic links"));
    }

    #[test]
    fn dev_null_survives() {
        write(Path::new("/dev/null"), b"gone").unwrap();
        Outputs::check(["/dev/null", "/dev/null"]).unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_an_error_and_replaces_no_file() {
        let folder = folder();
        let file = folder.path().join("file");
        fs::write(&file, "old").unwrap();
        let mut outputs = Outputs::new();
        outputs.stage(&file, b"new").unwrap();
        outputs.stage("/dev/full", b"lost").unwrap();
        assert!(message(outputs.commit()).contains("No space left"));
        assert_eq!(fs::read(&file).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_fifo_is_written_to() {
        let folder = folder();
        let fifo = folder.path().join("fifo");
        assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        let name = fifo.clone();
        let reader = std::thread::spawn(move || fs::read(name).unwrap());
        write(&fifo, b"through").unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        assert!(fs::symlink_metadata(&fifo).unwrap().file_type().is_fifo());
    }

    /// A log that a shell has opened with `>> log` must receive the bytes. It must not be replaced while the shell has
    /// it open.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_open_descriptor_is_appended_to() {
        use std::os::fd::AsRawFd;
        let folder = folder();
        let log = folder.path().join("log");
        fs::write(&log, "before, ").unwrap();
        let open = fs::OpenOptions::new().append(true).open(&log).unwrap();
        write(Path::new(&format!("/dev/fd/{}", open.as_raw_fd())), b"after").unwrap();
        assert_eq!(fs::read(&log).unwrap(), b"before, after");
        assert_eq!(names(folder.path()), ["log"]);
    }
}

#[test]
fn more_than_16_mib_of_text_in_a_png_is_refused_however_it_is_stored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.png");
    let image = Image::from_fn(1, 1, |_, _| 0u8);
    let half = |c: char| c.to_string().repeat((8 << 20) / c.len_utf8());
    // tEXt contains ASCII text, and iTXt any other. Neither is compressed.
    for (a, b) in [('a', 'a'), ('\u{e9}', '\u{e9}'), ('a', '\u{e9}')] {
        for (more, fits) in [("", true), ("\u{e9}", false)] {
            let (a, b) = (half(a), half(b) + more);
            fs::write(&path, png::encode(&image, &[("one", &a), ("other", &b)]).unwrap()).unwrap();
            match png::read_text(&path) {
                Ok(pairs) => assert!(fits && pairs.len() == 2),
                Err(error) => assert!(!fits && error.to_string().contains("past 16 MiB"), "{error}"),
            }
        }
    }
}
