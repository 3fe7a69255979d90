//! What a comparison says, as text, HTML or Markdown.

use crate::image::write_atomically;
use anyhow::{Context, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Tables and pictures.
#[derive(Debug, Default)]
pub struct Document {
    pub title: String,
    /// What it comes to, one sentence each.
    pub summary: Vec<String>,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
}

/// Rows under a title, the first cell of each its name.
#[derive(Debug, Default)]
pub struct Table {
    pub title: &'static str,
    /// Titles of the columns behind the first.
    pub columns: Vec<String>,
    pub rows: Vec<(String, Vec<String>)>,
    /// What the numbers are of.
    pub note: String,
}

/// Pictures side by side.
#[derive(Debug)]
pub struct Figure {
    pub title: &'static str,
    pub pictures: Vec<Picture>,
    pub note: String,
}

/// A PNG.
#[derive(Debug)]
pub struct Picture {
    /// What its file is called behind the report's name.
    pub name: &'static str,
    pub caption: String,
    pub png: Vec<u8>,
}

impl Table {
    pub fn new(title: &'static str, columns: &[&str]) -> Self {
        Table { title, columns: columns.iter().map(|c| (*c).to_owned()).collect(), ..Table::default() }
    }

    pub fn row(&mut self, name: &str, cells: impl IntoIterator<Item = String>) {
        self.rows.push((name.to_owned(), cells.into_iter().collect()));
    }
}

impl Document {
    /// The tables for a terminal.
    pub fn say(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "{}", self.title)?;
        self.summary.iter().try_for_each(|line| writeln!(out, "  {line}"))?;
        for table in &self.tables {
            writeln!(out)?;
            let width = |column: usize| {
                let cells = table.rows.iter().filter_map(|row| row.1.get(column)).chain(table.columns.get(column));
                cells.map(|cell| cell.chars().count()).max().unwrap_or(0) + 2
            };
            let first = table.rows.iter().map(|row| row.0.chars().count()).max().unwrap_or(0).max(table.title.chars().count()).max(22) + 2;
            let line = |name: &str, cells: &[String]| {
                let mut text = format!("{name:<first$}");
                for (i, cell) in cells.iter().enumerate() {
                    let _ = write!(text, "{cell:<0$}", width(i));
                }
                text.trim_end().to_owned()
            };
            writeln!(out, "{}", line(table.title, &table.columns))?;
            for (name, cells) in &table.rows {
                writeln!(out, "{}", line(name, cells))?;
            }
            if !table.note.is_empty() {
                writeln!(out, "({})", table.note)?;
            }
        }
        Ok(())
    }

    /// Writes a report: by its suffix HTML with its pictures in it, or Markdown with its pictures beside it.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = if is_markdown(path) { self.markdown(path)? } else { self.html() };
        write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
    }

    fn html(&self) -> String {
        let mut text = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
             <title>{0}</title>\n<style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n",
            escaped(&self.title)
        );
        if !self.summary.is_empty() {
            text += "<ul class=\"summary\">\n";
            self.summary.iter().for_each(|line| text += &format!("<li>{}</li>\n", escaped(line)));
            text += "</ul>\n";
        }
        for figure in &self.figures {
            text += &format!("<h2>{}</h2>\n<div class=\"pictures\">\n", escaped(figure.title));
            for picture in &figure.pictures {
                let (caption, data) = (escaped(&picture.caption), BASE64_STANDARD.encode(&picture.png));
                text += &format!(
                    "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n"
                );
            }
            text += &format!("</div>\n<p class=\"note\">{}</p>\n", escaped(&figure.note));
        }
        for table in &self.tables {
            text += &format!("<h2>{}</h2>\n<table><tr><th></th>", escaped(table.title));
            table.columns.iter().for_each(|column| text += &format!("<th>{}</th>", escaped(column)));
            text += "</tr>\n";
            for (name, cells) in &table.rows {
                text += &format!("<tr><th>{}</th>", escaped(name));
                cells.iter().for_each(|cell| text += &format!("<td>{}</td>", escaped(cell)));
                text += "</tr>\n";
            }
            text += &format!("</table>\n<p class=\"note\">{}</p>\n", escaped(&table.note));
        }
        text + "</body></html>\n"
    }

    fn markdown(&self, path: &Path) -> Result<String> {
        let mut text = format!("# {}\n\n", plain(&self.title));
        self.summary.iter().for_each(|line| text += &format!("* {}\n", plain(line)));
        for figure in &self.figures {
            text += &format!("\n## {}\n\n", figure.title);
            for (picture, file) in figure.pictures.iter().map(|picture| (picture, picture_file(path, picture.name))) {
                write_atomically(&file, |out| out.write_all(&picture.png)).with_context(|| file.display().to_string())?;
                let name = file.file_name().map(|name| name.to_string_lossy().replace(' ', "%20")).unwrap_or_default();
                text += &format!("![{0}]({name})\n{0}\n\n", plain(&picture.caption));
            }
            text += &format!("{}\n", plain(&figure.note));
        }
        for table in &self.tables {
            let cells = |cells: &[String]| cells.iter().map(|cell| format!(" {} |", plain(cell))).collect::<String>();
            text += &format!("\n## {}\n\n| |{}\n|---|{}\n", table.title, cells(&table.columns), "---:|".repeat(table.columns.len()));
            table.rows.iter().for_each(|(name, row)| text += &format!("| {} |{}\n", plain(name), cells(row)));
            if !table.note.is_empty() {
                text += &format!("\n{}\n", plain(&table.note));
            }
        }
        Ok(text)
    }
}

/// Whether a report's file is to be Markdown.
pub fn is_markdown(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("md"))
}

/// Where a picture of a Markdown report goes.
pub fn picture_file(report: &Path, name: &str) -> PathBuf {
    let stem = report.file_stem().unwrap_or_default().to_string_lossy();
    report.with_file_name(format!("{stem}_{name}.png"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Text in which Markdown sees no marks of its own.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    for c in text.chars() {
        if "|*_`<[\\".contains(c) {
            plain.push('\\');
        }
        plain.push(c);
    }
    plain
}

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;color:#1c2126;max-width:1180px;margin:2em auto;padding:0 1em}\
h1{font-size:1.5em;font-weight:600;overflow-wrap:anywhere}h2{font-size:1.1em;font-weight:600;margin:2em 0 .5em}\
table{border-collapse:collapse}th,td{text-align:right;padding:.25em .9em;border-bottom:1px solid #e3e6e9;font-weight:400;\
font-variant-numeric:tabular-nums;vertical-align:top}tr>:first-child{text-align:left;padding-left:0;color:#48525c}\
tr:first-child th{font-weight:600;color:#1c2126;overflow-wrap:anywhere}.note{color:#5d6873;font-size:.88em;margin:.4em 0;max-width:75em}\
.summary{padding-left:1.2em}.summary li{margin:.2em 0}.pictures{display:flex;flex-wrap:wrap;gap:12px}\
figure{margin:0;flex:1 1 300px;max-width:560px}figure img{width:100%;display:block;border-radius:4px}\
figcaption{color:#48525c;font-size:.88em;padding:.35em 0}";

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let mut table = Table::new("numbers", &["a_1", "b & c"]);
        table.row("area", ["1".into(), "20 | 3".into()]);
        let pictures = vec![Picture { name: "a", caption: "A <1>".into(), png: vec![1, 2, 3] }];
        let figures = vec![Figure { title: "seen", pictures, note: String::new() }];
        Document { title: "a < b".into(), summary: vec!["all is well".into()], tables: vec![table], figures }
    }

    #[test]
    fn the_three_forms_say_the_same() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut said = Vec::new();
        document().say(&mut said).expect("written");
        let said = String::from_utf8(said).expect("text");
        assert!(said.contains("area                    1    20 | 3\n"), "{said}");

        let html = folder.path().join("r.html");
        document().write(&html).expect("written");
        let html = std::fs::read_to_string(html).expect("a file");
        for part in ["<h1>a &lt; b</h1>", "<td>20 | 3</td>", "base64,AQID\"", "b &amp; c", "A &lt;1&gt;", "all is well"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        let markdown = folder.path().join("my r.md");
        document().write(&markdown).expect("written");
        let text = std::fs::read_to_string(&markdown).expect("a file");
        for part in ["| a\\_1 | b & c |", "| area | 1 | 20 \\| 3 |", "](my%20r_a.png)", "A \\<1>"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert_eq!(std::fs::read(folder.path().join("my r_a.png")).expect("a file"), [1, 2, 3]);
    }
}
