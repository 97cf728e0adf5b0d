//! The directory of results while it is being filled: what is complete stays, the rest is flown again.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::error::CampaignError;
use super::plan::Campaign;
use super::row::Row;
use super::table::{DEFINITION, RowReader, TABLE, header};

/// The table of a campaign, open at the end of its last complete run.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    table: File,
    /// Number of the first run that is missing.
    next: u32,
}

impl Store {
    /// Opens the results of the runs `share` in `directory`, or begins them; with `restart`, anew.
    ///
    /// # Errors
    /// When the directory holds another campaign or another share, when another process fills it, or
    /// when it cannot be read or written.
    pub fn open(
        directory: &Path,
        campaign: &Campaign,
        share: &Range<u32>,
        restart: bool,
    ) -> Result<Self, CampaignError> {
        let (path, table) = open_table(directory, TABLE, campaign, restart)?;
        let mut store = Self { path, table, next: share.start };
        let length = store.recover(campaign, share)?;
        store.cut(length, campaign).map_err(CampaignError::io(&store.path))?;
        Ok(store)
    }

    /// Counts the complete runs; bytes of the table up to the end of the last of them.
    fn recover(&mut self, campaign: &Campaign, share: &Range<u32>) -> Result<u64, CampaignError> {
        let failed = CampaignError::io(&self.path);
        let lines = end_of_lines(&mut self.table).map_err(&failed)?;
        self.table.rewind().map_err(&failed)?;
        let first = header(campaign);
        if lines < first.len() as u64 {
            return Ok(0);
        }
        let mut rows = RowReader::new(campaign, (&self.table).take(lines), &self.path)?;
        let mut order = Order::new(campaign, share.start);
        let mut end = rows.position();
        while let Some(row) = rows.next() {
            order.check(&row?).map_err(|it| CampaignError::Results(self.path.clone(), it))?;
            if order.variant == 0 {
                end = rows.position();
            }
        }
        if order.index > share.end {
            let message = "holds runs beyond this share".to_owned();
            return Err(CampaignError::Results(self.path.clone(), message));
        }
        self.next = order.index;
        Ok(end)
    }

    /// Cuts off what follows `length`, and begins the table if nothing is left.
    fn cut(&mut self, length: u64, campaign: &Campaign) -> io::Result<()> {
        self.table.set_len(length)?;
        self.table.seek(SeekFrom::Start(length))?;
        if length == 0 {
            self.table.write_all(header(campaign).as_bytes())?;
        }
        Ok(())
    }

    /// Number of the first run that is missing.
    #[must_use]
    pub fn next(&self) -> u32 {
        self.next
    }

    /// Appends lines of the table.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn append(&mut self, lines: &str) -> Result<(), CampaignError> {
        self.table.write_all(lines.as_bytes()).map_err(CampaignError::io(&self.path))
    }
}

/// The table `name` of `campaign` in `directory`, locked; with `restart`, or where nothing is, empty and with its
/// definition beside it.
///
/// # Errors
/// When the directory holds another campaign, another process fills it, or it cannot be read or written.
pub(super) fn open_table(
    directory: &Path,
    name: &str,
    campaign: &Campaign,
    restart: bool,
) -> Result<(PathBuf, File), CampaignError> {
    fs::create_dir_all(directory).map_err(CampaignError::io(directory))?;
    let path = directory.join(name);
    let failed = CampaignError::io(&path);
    let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let table = open.map_err(&failed)?;
    if table.try_lock().is_err() {
        let message = "another process is filling it".to_owned();
        return Err(CampaignError::Results(path.clone(), message));
    }
    let length = table.metadata().map_err(&failed)?.len();
    if restart || !continues(directory, length, campaign)? {
        table.set_len(0).map_err(&failed)?;
        write_whole(&directory.join(DEFINITION), campaign.text().as_bytes())?;
    }
    drop(failed);
    Ok((path, table))
}

/// `true` if `directory` holds results of this very campaign, in a table of `length` bytes; an error if of another.
fn continues(directory: &Path, length: u64, campaign: &Campaign) -> Result<bool, CampaignError> {
    let path = directory.join(DEFINITION);
    match fs::read_to_string(&path) {
        Ok(text) if text == campaign.text() => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound && length == 0 => Ok(false),
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(CampaignError::io(&path)(error))
        }
        _ => Err(CampaignError::Results(
            directory.to_owned(),
            "holds results of another definition; choose another output directory, or restart \
             to overwrite them"
                .to_owned(),
        )),
    }
}

/// Checks that rows come by seed and then by variant, without a gap.
#[derive(Debug)]
pub(super) struct Order<'a> {
    campaign: &'a Campaign,
    /// Number of the run that comes next.
    pub(super) index: u32,
    /// Its variant that comes next.
    pub(super) variant: usize,
}

impl<'a> Order<'a> {
    /// Of rows that begin with run `first`.
    pub(super) fn new(campaign: &'a Campaign, first: u32) -> Self {
        Self { campaign, index: first, variant: 0 }
    }

    /// Takes in the next row; what is wrong if it is not the one that comes next.
    pub(super) fn check(&mut self, row: &Row) -> Result<(), String> {
        let Self { campaign, index, variant } = *self;
        if index >= campaign.runs() || (row.seed, row.variant) != (campaign.seed(index), variant) {
            let found = &campaign.variants()[row.variant].name;
            return Err(format!("seed {} in variant `{found}` is out of order", row.seed));
        }
        self.variant = (variant + 1) % campaign.variants().len();
        self.index += u32::from(self.variant == 0);
        Ok(())
    }
}

/// Bytes up to the end of the last complete line.
pub(super) fn end_of_lines(file: &mut File) -> io::Result<u64> {
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut block = [0; 4096];
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        let block = &mut block[..(end - start) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(block)?;
        if let Some(place) = block.iter().rposition(|&byte| byte == b'\n') {
            return Ok(start + place as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// Writes a file so that it is there either whole or not at all.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), CampaignError> {
    let part = path.with_extension("part");
    fs::write(&part, bytes).and_then(|()| fs::rename(&part, path)).map_err(CampaignError::io(path))
}
