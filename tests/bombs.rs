//! Files that are small on the disk and huge once unpacked: refused by what they say of themselves, or read no further
//! than they are of use. Whatever they hold, they take a bounded amount of memory.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use taut::log::{read_columns, read_samples};

fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bomb-{name}"))
}

/// The error on a file, without its folder.
fn told(file: &Path, error: &taut::Error) -> String {
    error.to_string().replace(&file.display().to_string(), "FILE")
}

mod matlab {
    use super::*;

    /// An element: type, size, data, filled up to eight bytes.
    fn element(kind: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    }

    /// An array of doubles as it is before its numbers.
    fn begun(name: &str, rows: u32, columns: u32) -> Vec<u8> {
        let mut bytes = element(6, &[6, 0, 0, 0, 0, 0, 0, 0]);
        bytes.extend(element(5, &[rows.to_le_bytes(), columns.to_le_bytes()].concat()));
        bytes.extend(element(1, name.as_bytes()));
        bytes
    }

    /// The tag of so many doubles.
    fn tag(count: u32) -> Vec<u8> {
        [9u32.to_le_bytes(), count.wrapping_mul(8).to_le_bytes()].concat()
    }

    /// An array packed: its beginning, then zeros.
    fn packed(beginning: &[u8], zeros: usize) -> Vec<u8> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(&[14u32.to_le_bytes(), (beginning.len() as u32).to_le_bytes()].concat()).unwrap();
        encoder.write_all(beginning).unwrap();
        let block = vec![0; 1 << 16];
        for begin in (0..zeros).step_by(block.len()) {
            encoder.write_all(&block[..block.len().min(zeros - begin)]).unwrap();
        }
        let data = encoder.finish().unwrap();
        [&15u32.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), &data].concat()
    }

    fn file(name: &str, arrays: &[Vec<u8>]) -> PathBuf {
        let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
        bytes.resize(124, b' ');
        bytes.extend(b"\x00\x01IM");
        arrays.iter().for_each(|array| bytes.extend(array));
        let path = place(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn message(file: &Path, time: &str, column: &str) -> String {
        told(file, &read_samples(file, time, column).unwrap_err())
    }

    /// A file of 1.4 MB took 4.7 GB: all arrays were unpacked whole, whatever they held.
    #[test]
    fn times_that_stand_still_end_the_reading() {
        // 512 MiB each; the numbers of `u` break off, which nobody gets to see.
        let count = 1 << 24;
        let t = packed(&[begun("t", count, 1), tag(count)].concat(), 8 << 24);
        let u = packed(&[begun("u", count, 1), tag(count)].concat(), 80_000);
        let path = file("still.mat", &[t, u]);
        assert!(fs::metadata(&path).unwrap().len() < 2_000_000);
        assert_eq!(
            message(&path, "t", "u"),
            "FILE: time 0 in row 2 repeats that of row 1\n  allowed: times that increase from row to row\n  next: keep one row of each time"
        );
        let error = read_columns(&path, &["u"]).unwrap_err();
        assert!(told(&path, &error).starts_with("FILE: this MATLAB file breaks off before its end"), "{error}");
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn what_is_too_much_is_refused_before_it_is_unpacked() {
        let count = 30_000_000;
        let arrays = ["t", "u"].map(|name| packed(&[begun(name, count, 1), tag(count)].concat(), 0));
        let path = file("many.mat", &arrays);
        assert_eq!(
            message(&path, "t", "u"),
            "FILE: 30000000 rows of 2 columns are too many\n  allowed: up to 16777216 rows of that many columns\n  \
             next: save a part of the recording, every n-th row of it, or fewer columns"
        );
        // Few numbers of a matrix that is huge.
        let wide = packed(&[begun("data", 1000, 200_000), tag(200_000_000)].concat(), 0);
        let path = file("wide.mat", &[wide]);
        assert_eq!(
            message(&path, "data(:,1)", "data(:,2)"),
            "FILE: the wanted variables take 1525 MiB once unpacked\n  allowed: up to 1024 MiB\n  \
             next: save the columns that are needed as variables of their own"
        );
        // A size that overflows.
        let path = file("overflow.mat", &[packed(&[begun("t", 0x7FFF_FFFF, 0x7FFF_FFFF), tag(8)].concat(), 64)]);
        assert!(message(&path, "t(:,1)", "t(:,2)").starts_with("FILE: 2147483647 rows of 2 columns are too many"));
        ["many.mat", "wide.mat", "overflow.mat"].iter().for_each(|name| fs::remove_file(place(name)).unwrap());
    }

    /// The dimensions of one array were read as long as they went: 1 GiB of bytes made 8 GiB of numbers.
    #[test]
    fn what_an_array_says_of_itself_is_short() {
        let good = [packed(&[begun("t", 2, 1), tag(2), vec![0; 8], 1f64.to_le_bytes().to_vec()].concat(), 0)];
        let long = |head: Vec<u8>| {
            packed(&[head, [1u32.to_le_bytes(), (1u32 << 28).to_le_bytes()].concat()].concat(), 1 << 20)
        };
        let flags = element(6, &[6, 0, 0, 0, 0, 0, 0, 0]);
        let dimensions = element(5, &[1u32.to_le_bytes(), 1u32.to_le_bytes()].concat());
        for (name, head) in [("dims.mat", flags.clone()), ("name.mat", [flags, dimensions].concat())] {
            // Of an array that nobody asked for.
            let path = file(name, &[good[0].clone(), long(head)]);
            assert_eq!(
                message(&path, "t", "t"),
                "FILE: this MATLAB file is damaged: the name or the dimensions of an array are longer than 4096 bytes\n  \
                 next: save it again, in MATLAB with save('log.mat', '-v7'), in Python with scipy.io.savemat"
            );
            fs::remove_file(path).unwrap();
        }
        let path = file("good.mat", &good);
        assert_eq!(read_samples(&path, "t", "t").unwrap().0, [0.0, 1.0]);
        fs::remove_file(path).unwrap();
    }

    /// Arrays that are not asked for are passed over, however large.
    #[test]
    fn what_is_not_wanted_is_not_unpacked() {
        let other = packed(&[begun("other", 1 << 14, 1 << 14), tag(1 << 28)].concat(), 1 << 16);
        let t = packed(&[begun("t", 2, 1), tag(2), vec![0; 8], 1f64.to_le_bytes().to_vec()].concat(), 0);
        let path = file("other.mat", &[other, t]);
        assert_eq!(read_columns(&path, &["t"]).unwrap(), [[0.0, 1.0]]);
        fs::remove_file(path).unwrap();
    }
}

/// A text of tables makes hundreds of bytes of every one of its own: 9 MB of headers took 455 MB.
mod case {
    use taut::case::{Case, TEMPLATE};

    fn message(text: &str) -> String {
        let error = Case::from_text("axis.toml", &format!("{TEMPLATE}\n{text}")).unwrap_err().to_string();
        error.lines().filter(|line| !line.contains(" | ")).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn nested_headers_and_keys_are_refused() {
        let deep = vec!["a"; 40].join(".");
        let many: String = (0..20_000).map(|k| format!("[x{k}.{deep}]\n")).collect();
        for text in [&many as &str, &format!("{deep} = 1"), &format!("a = {{ {deep} = 1 }}"), &format!("[[{deep}]]")] {
            let told = message(text);
            assert!(told.ends_with(": this is nested too deeply\n  next: nest lists and tables less deeply"), "{told}");
        }
        // Points in numbers, texts and remarks nest nothing.
        let fine = format!("title = \"{deep}\" # {deep}\n");
        assert!(Case::from_text("axis.toml", &format!("{fine}{}", TEMPLATE.replacen("title", "# title", 1))).is_ok());
    }

    #[test]
    fn too_many_values_are_refused_and_long_tables_are_not() {
        let input = |points: usize| {
            let points: Vec<String> = (0..points).map(|k| format!("[{}.5, 1.0]", k)).collect();
            let new = format!("input = {{ table = [{}] }}", points.join(", "));
            TEMPLATE.replacen("input = { pulse = \"5 V\", for = \"0.25 s\" }", &new, 1)
        };
        let case = Case::from_text("axis.toml", &input(100_000)).unwrap();
        assert!(
            matches!(&case.experiments[0].inputs[0], taut::signal::Signal::Table { points } if points.len() == 100_000)
        );
        let error = Case::from_text("axis.toml", &input(400_000)).unwrap_err().to_string();
        assert!(error.contains(": this case file holds too many values, keys and tables\n"), "{error}");
        assert!(error.ends_with(
            "allowed: some 300,000 points of a table, 500,000 keys, or 180,000 tables\n  \
             next: put long tables into a CSV file, and read it with input = { file = ... }"
        ));
        let keys: String = (0..600_000).map(|k| format!("a{k}=1\n")).collect();
        let headers: String = (0..100_000).map(|k| format!("[x{k}.1.a]\n")).collect();
        let inline: String = (0..60_000).map(|k| format!("b{k}={{1.1.1.c=[{{}}]}}\n")).collect();
        for text in [keys, headers, inline] {
            assert!(message(&text).contains("too many values"));
        }
        // A long text is one value.
        let long = format!("title = \"\"\"{}\"\"\"\n", "a.b, c=[d]\n".repeat(1_000_000));
        assert!(Case::from_text("axis.toml", &format!("{long}{}", TEMPLATE.replacen("title", "# title", 1))).is_ok());
    }

    /// Every look-up of a sequence counted its turns from the first on.
    #[test]
    fn a_sequence_of_a_hundred_thousand_turns_is_read_and_walked() {
        let turns: Vec<String> = (0..100_000).map(|k| format!("{{ step = {}, lasts = 1e-5 }}", k % 5)).collect();
        let new = format!("input = {{ sequence = [{}] }}", turns.join(", "));
        let text = TEMPLATE.replacen("input = { pulse = \"5 V\", for = \"0.25 s\" }", &new, 1);
        let input = &Case::from_text("axis.toml", &text).unwrap().experiments[0].inputs[0];
        let (mut t, mut seams) = (0.0, 0);
        while t < 0.999_995 {
            (t, seams) = (input.piece(t).end, seams + 1);
        }
        assert!((99_999..=100_000).contains(&seams), "{seams}");
    }
}

#[cfg(feature = "parquet")]
mod parquet {
    use super::*;
    use ::parquet::data_type::DoubleType;
    use ::parquet::file::properties::WriterProperties;
    use ::parquet::file::writer::SerializedFileWriter;
    use ::parquet::schema::parser::parse_message_type;
    use std::sync::Arc;

    /// Columns of the same numbers, in blocks of 2^20.
    fn file(name: &str, columns: &[&str], blocks: usize, value: impl Fn(usize) -> f64) -> PathBuf {
        let path = place(name);
        let fields: String = columns.iter().map(|name| format!("REQUIRED DOUBLE {name};")).collect();
        let schema = Arc::new(parse_message_type(&format!("message m {{ {fields} }}")).unwrap());
        let properties = Arc::new(WriterProperties::builder().build());
        let mut writer = SerializedFileWriter::new(fs::File::create(&path).unwrap(), schema, properties).unwrap();
        let numbers: Vec<f64> = (0..1 << 20).map(value).collect();
        let mut group = writer.next_row_group().unwrap();
        while let Some(mut column) = group.next_column().unwrap() {
            for _ in 0..blocks {
                column.typed::<DoubleType>().write_batch(&numbers, None, None).unwrap();
            }
            column.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        path
    }

    /// A dictionary of one number and a count: gigabytes in a few hundred bytes.
    #[test]
    fn rows_that_are_too_many_are_refused_by_their_number() {
        let path = file("rows.parquet", &["t", "u"], 17, |_| 0.0);
        assert!(fs::metadata(&path).unwrap().len() < 1_000_000);
        let error = read_samples(&path, "t", "u").unwrap_err();
        assert_eq!(
            told(&path, &error),
            "FILE: 17825792 rows of 2 columns are too many\n  allowed: up to 16777216 rows of that many columns\n  \
             next: save a part of the recording, every n-th row of it, or fewer columns"
        );
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn times_that_stand_still_end_the_reading() {
        let path = file("still.parquet", &["t", "u"], 2, |k| (k / 10_000) as f64);
        let error = read_samples(&path, "t", "u").unwrap_err();
        assert!(told(&path, &error).starts_with("FILE: time 0 in row 2 repeats that of row 1"), "{error}");
        assert_eq!(read_columns(&path, &["t"]).unwrap()[0].len(), 2 << 20);
        fs::remove_file(path).unwrap();
    }

    /// The reader takes as much memory as the header of a page asks for, 2 GiB say, before it looks at the page.
    #[test]
    fn a_page_that_asks_for_too_much_is_refused() {
        let path = file("page.parquet", &["t"], 1, |k| k as f64);
        let mut bytes = fs::read(&path).unwrap();
        // Behind the mark: field 1, the kind of the page; field 2, its size unpacked, seven bits to a byte.
        assert_eq!((bytes[4], bytes[6]), (0x15, 0x15));
        let end = 7 + bytes[7..].iter().position(|byte| byte & 0x80 == 0).unwrap();
        bytes.splice(7..=end, [0xFE, 0xFF, 0xFF, 0xFF, 0x0F]);
        fs::write(&path, &bytes).unwrap();
        let error = read_columns(&path, &["t"]).unwrap_err();
        assert_eq!(
            told(&path, &error),
            "FILE: a page of this Parquet file takes 2047 MiB once unpacked\n  allowed: up to 256 MiB\n  \
             next: write it again with smaller pages, 1 MiB is usual; or as CSV"
        );
        bytes[7..12].copy_from_slice(&[0x15; 5]);
        bytes[12..200].fill(0xFF);
        fs::write(&path, &bytes).unwrap();
        let error = read_columns(&path, &["t"]).unwrap_err();
        assert!(told(&path, &error).starts_with("FILE: this Parquet file cannot be read: "), "{error}");
        fs::remove_file(path).unwrap();
    }
}
