//! ngspice's raw file: a text header, then little-endian float64 records or one value a line. A table is written whole, or
//! row by row while a run goes on: rows first, then the number of points in the header, so that at every moment the file is one
//! that all readers take, up to its last rows.
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};

pub struct Header {
    pub title: String,
    pub date: String,
    pub plotname: String,
    pub command: String,
    pub variables: Vec<(String, String)>, // names and types
}

/// Digits of the number of points, filled up with blanks.
const DIGITS: usize = 12;

impl Header {
    /// Text, and where in it the number of points stands.
    fn text(&self, points: usize, ascii: bool) -> (String, usize) {
        let mut out = format!(
            "Title: {}\nDate: {}\nPlotname: {}\nFlags: real\nNo. Variables: {}\nNo. Points: ",
            self.title,
            self.date,
            self.plotname,
            self.variables.len()
        );
        let at = out.len();
        out += &format!("{points:<DIGITS$}\nCommand: {}\nVariables:\n", self.command);
        for (k, (name, kind)) in self.variables.iter().enumerate() {
            out += &format!("\t{k}\t{name}\t{kind}\n");
        }
        out += if ascii { "Values:\n" } else { "Binary:\n" };
        (out, at)
    }
}

/// Which numbers of a row go to the file.
#[derive(Clone, Copy)]
pub struct Rows {
    pub width: usize,
    pub first: usize,
    pub columns: usize,
}

impl Rows {
    fn of<'a>(&self, data: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
        let (first, end) = (self.first, self.first + self.columns);
        data.chunks_exact(self.width.max(1)).map(move |row| &row[first..end])
    }
}

/// A table in a file that grows.
struct Table {
    file: File,
    rows: Rows,
    count: usize, // rows in the file
    count_at: u64,
    records_at: u64,
}

impl Table {
    /// Behind what a file holds, or in a new one: nobody else's file of that name, nor where a link of that name leads.
    fn begin(path: &str, append: bool, head: &Header, rows: Rows) -> io::Result<Table> {
        let mut file = OpenOptions::new().write(true).create_new(!append).open(path)?;
        let start = file.seek(SeekFrom::End(0))?;
        let (text, at) = head.text(0, false);
        file.write_all(text.as_bytes())?;
        Ok(Table { file, rows, count: 0, count_at: start + at as u64, records_at: start + text.len() as u64 })
    }

    /// The rows of `data` that the file does not have yet. After an error it ends with the last whole row that it took.
    fn append(&mut self, data: &[f64]) -> io::Result<()> {
        self.try_append(data).inspect_err(|_| {
            let size = (8 * self.rows.columns).max(1) as u64;
            let length = self.file.metadata().map_or(0, |m| m.len());
            let whole = length.saturating_sub(self.records_at) / size;
            let _ = self.file.set_len(self.records_at + size * whole);
            let _ = self.told(whole as usize);
        })
    }

    fn told(&mut self, count: usize) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.count_at))?;
        self.file.write_all(format!("{count:<DIGITS$}").as_bytes())?;
        self.count = count;
        Ok(())
    }

    fn try_append(&mut self, data: &[f64]) -> io::Result<()> {
        let width = self.rows.width.max(1);
        let mut bytes = Vec::new();
        // numbers of a piece
        for piece in data[(self.count * width).min(data.len())..].chunks(((1 << 17) / width).max(1) * width) {
            self.file.seek(SeekFrom::End(0))?;
            if cfg!(target_endian = "little") && self.rows.columns == width {
                self.file.write_all(as_bytes(piece))?;
            } else {
                bytes.clear();
                bytes.extend(self.rows.of(piece).flatten().flat_map(|v| v.to_le_bytes()));
                self.file.write_all(&bytes)?;
            }
            self.told(self.count + piece.len() / width)?;
        }
        Ok(())
    }
}

/// Numbers as they lie in memory.
fn as_bytes(numbers: &[f64]) -> &[u8] {
    // SAFETY: any bytes of numbers are bytes, and there are as many
    unsafe { std::slice::from_raw_parts(numbers.as_ptr().cast(), std::mem::size_of_val(numbers)) }
}

/// The rows of a run on their way to a file, which is made when the first ones come.
pub struct Stream {
    path: String,
    append: bool,
    head: Header,
    rows: Rows,
    table: Option<Table>,
    error: Option<io::Error>,
}

impl Stream {
    pub fn new(path: String, append: bool, head: Header, rows: Rows) -> Stream {
        Stream { path, append, head, rows, table: None, error: None }
    }

    /// `data`: all rows so far. After an error nothing more is written.
    pub fn append(&mut self, data: &[f64]) {
        if self.error.is_some() {
            return;
        }
        if self.table.is_none() {
            match Table::begin(&self.path, self.append, &self.head, self.rows) {
                Ok(table) => self.table = Some(table),
                Err(error) => self.error = Some(error),
            }
        }
        if let Some(Err(error)) = self.table.as_mut().map(|table| table.append(data)) {
            self.error = Some(error);
        }
    }

    /// The last rows, where the run came to write any. None where it did not, or where the file of that name is another one by
    /// now; else the number of rows in the file and what went wrong.
    pub fn finish(&mut self, data: &[f64]) -> Option<(usize, Option<&io::Error>)> {
        self.table.as_ref()?;
        self.append(data);
        let table = self.table.as_ref()?;
        same(&table.file, &self.path).then_some((table.count, self.error.as_ref()))
    }
}

#[cfg(unix)]
fn same(file: &File, path: &str) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn same(_: &File, path: &str) -> bool {
    std::fs::metadata(path).is_ok()
}

/// A whole table, behind what a file holds.
pub fn write(path: &str, head: &Header, data: &[f64], rows: Rows, ascii: bool) -> io::Result<()> {
    if !ascii {
        return Table::begin(path, true, head, rows)?.append(data);
    }
    let file = OpenOptions::new().append(true).open(path)?;
    let mut out = BufWriter::with_capacity(1 << 20, file);
    out.write_all(head.text(data.len() / rows.width.max(1), true).0.as_bytes())?;
    for (k, row) in rows.of(data).enumerate() {
        write!(out, "{k}")?;
        for v in row {
            writeln!(out, "\t{v:.16e}")?;
        }
        writeln!(out)?;
    }
    out.flush()
}
