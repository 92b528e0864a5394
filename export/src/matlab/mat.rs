//! MAT-files of level 5: numbers, words and lists of words.

/// A variable of the file.
pub(super) enum Variable {
    /// Rows of numbers, all of one length.
    Numbers(Vec<Vec<f64>>),
    /// A list of words, as a cell array in a column.
    Words(Vec<String>),
}

/// miINT8, miUINT16, miINT32, miUINT32, miDOUBLE, miMATRIX
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;

/// mxCELL_CLASS, mxCHAR_CLASS, mxDOUBLE_CLASS
const CELL_CLASS: u32 = 1;
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;

/// The file with these variables.
pub(super) fn file(variables: &[(&str, Variable)]) -> Vec<u8> {
    let mut bytes = format!("MATLAB 5.0 MAT-file, written by taut {}", env!("CARGO_PKG_VERSION")).into_bytes();
    bytes.resize(116, b' ');
    // No subsystem data; version 1; the order of bytes.
    bytes.extend([0; 8]);
    bytes.extend(0x0100_u16.to_le_bytes());
    bytes.extend(*b"IM");
    for (name, variable) in variables {
        bytes.extend(match variable {
            Variable::Numbers(rows) => numbers(name, rows),
            Variable::Words(words) => {
                let cells = words.iter().flat_map(|word| text(word)).collect();
                matrix(CELL_CLASS, [words.len(), 1], name, cells)
            }
        });
    }
    bytes
}

/// A part with its tag, filled up to eight bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(data.len() + 16);
    bytes.extend(kind.to_le_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn matrix(class: u32, size: [usize; 2], name: &str, data: Vec<u8>) -> Vec<u8> {
    let flags: Vec<u8> = [class, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let size: Vec<u8> = size.iter().flat_map(|n| (*n as i32).to_le_bytes()).collect();
    let parts = [element(UINT32, &flags), element(INT32, &size), element(INT8, name.as_bytes()), data];
    element(MATRIX, &parts.concat())
}

fn numbers(name: &str, rows: &[Vec<f64>]) -> Vec<u8> {
    let columns = rows.first().map_or(0, Vec::len);
    // By columns.
    let data: Vec<u8> = (0..columns).flat_map(|j| rows.iter().flat_map(move |row| row[j].to_le_bytes())).collect();
    matrix(DOUBLE_CLASS, [rows.len(), columns], name, element(DOUBLE, &data))
}

fn text(word: &str) -> Vec<u8> {
    let units: Vec<u16> = word.encode_utf16().collect();
    let data: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
    matrix(CHAR_CLASS, [1, units.len()], "", element(UINT16, &data))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_filled_up_to_eight_bytes() {
        let bytes = file(&[
            ("A", Variable::Numbers(vec![vec![1.0, 2.0], vec![3.0, 4.0]])),
            ("names", Variable::Words(vec!["a".into(), "length".into()])),
        ]);
        assert_eq!(&bytes[124..128], &[0, 1, b'I', b'M']);
        let mut at = 128;
        while at < bytes.len() {
            assert_eq!(bytes[at..at + 4], MATRIX.to_le_bytes());
            let length = u32::from_le_bytes(bytes[at + 4..at + 8].try_into().unwrap()) as usize;
            assert!(length.is_multiple_of(8));
            at += 8 + length;
        }
        assert_eq!(at, bytes.len());
        // By columns: 1, 3, 2, 4 behind flags, size, name and the tag of the numbers.
        let of = |k: usize| f64::from_le_bytes(bytes[192 + 8 * k..200 + 8 * k].try_into().unwrap());
        assert_eq!([of(0), of(1), of(2), of(3)], [1.0, 3.0, 2.0, 4.0]);
    }
}
