//! The XML of an XDMF file as a tree, and the paths (XPath, a small part of it) by which its elements refer to each other.

use crate::format::ParseError;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

/// Elements that may be open at once.
const DEPTH_LIMIT: usize = 50;
/// Elements that one file may have.
const NODES_LIMIT: usize = 1 << 20;
/// Attributes that one tag may have.
const ATTRIBUTES_LIMIT: usize = 100;

/// An element by its place in the tree.
pub(super) type Id = usize;

#[derive(Debug, Default)]
struct Node {
    /// Its name without the prefix of a name space.
    name: String,
    attributes: Vec<(String, String)>,
    text: String,
    children: Vec<Id>,
}

/// All elements of a file.
#[derive(Debug)]
pub(super) struct Tree {
    /// The first is the document itself, which has no name.
    nodes: Vec<Node>,
}

impl Tree {
    /// The document, which has the outermost element as its child.
    pub const DOCUMENT: Id = 0;

    /// Reads a text. Entities that a document type declares are not known to it, so a text cannot grow.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        let (mut nodes, mut open) = (vec![Node::default()], vec![Tree::DOCUMENT]);
        loop {
            let at = reader.buffer_position();
            let wrong = |what: String| ParseError::invalid(format!("byte {at}"), what, "well-formed XML");
            let current = *open.last().unwrap_or(&Tree::DOCUMENT);
            match reader.read_event().map_err(|e| wrong(e.to_string()))? {
                Event::Start(tag) => {
                    if open.len() > DEPTH_LIMIT || nodes.len() > NODES_LIMIT {
                        return Err(wrong(format!("more than {DEPTH_LIMIT} open elements or {NODES_LIMIT} in all")));
                    }
                    let node = Node::new(&tag).map_err(wrong)?;
                    let id = nodes.len();
                    nodes[current].children.push(id);
                    open.push(id);
                    nodes.push(node);
                }
                Event::End(_) => {
                    open.pop();
                }
                Event::Text(more) => nodes[current].text.push_str(&more),
                Event::CData(more) => nodes[current].text.push_str(&more),
                Event::GeneralRef(entity) => {
                    let character = match &*entity {
                        "amp" => Some('&'),
                        "lt" => Some('<'),
                        "gt" => Some('>'),
                        "quot" => Some('"'),
                        "apos" => Some('\''),
                        _ => entity.resolve_char_ref().map_err(|e| wrong(e.to_string()))?,
                    };
                    nodes[current].text.push(character.ok_or_else(|| wrong(format!("the entity \"{}\"", &*entity)))?);
                }
                Event::Eof if open.len() > 1 => return Err(wrong(format!("the end of the file within <{}>", nodes[current].name))),
                Event::Eof => return Ok(Tree { nodes }),
                _ => {}
            }
        }
    }

    /// An element's name.
    pub fn name(&self, id: Id) -> &str {
        &self.nodes[id].name
    }

    /// The text in an element.
    pub fn text(&self, id: Id) -> &str {
        self.nodes[id].text.trim()
    }

    /// The value of an attribute without the blanks around it; `None` if it is absent or empty.
    pub fn get(&self, id: Id, attribute: &str) -> Option<&str> {
        let (_, value) = self.nodes[id].attributes.iter().find(|(name, _)| name.eq_ignore_ascii_case(attribute))?;
        Some(value.trim()).filter(|value| !value.is_empty())
    }

    /// The elements of a name within one.
    pub fn children<'a>(&'a self, id: Id, name: &'a str) -> impl Iterator<Item = Id> + 'a {
        self.nodes[id].children.iter().copied().filter(move |&child| self.nodes[child].name == name)
    }

    /// How an element is called in messages: its name and its `Name`.
    pub fn place(&self, id: Id) -> String {
        let of = self.get(id, "Name").map_or_else(String::new, |name| format!(" \"{name}\""));
        format!("<{}>{of}", self.name(id))
    }

    /// The elements that a path leads to, from the document: `/Xdmf/Domain/Grid[2]`, `//Grid[@Name="mesh"]/*[self::Topology or
    /// self::Geometry]`. `None` if the path is of a kind that is not known.
    pub fn select(&self, path: &str) -> Option<Vec<Id>> {
        let path = path.trim();
        let path = path.strip_prefix("xpointer(").and_then(|path| path.strip_suffix(')')).unwrap_or(path).trim();
        let mut found = vec![Tree::DOCUMENT];
        let mut rest = path.strip_prefix('/').unwrap_or(path);
        while !rest.is_empty() {
            let (everywhere, from) = rest.strip_prefix('/').map_or((false, rest), |rest| (true, rest));
            let (step, behind) = split_step(from);
            let (test, predicates) = step.split_at(step.find('[').unwrap_or(step.len()));
            let parents = if everywhere { self.with_descendants(&found) } else { found };
            let mut next = Vec::new();
            for parent in parents {
                let is_named = |&child: &Id| test == "*" || self.nodes[child].name == test;
                let mut children: Vec<Id> = self.nodes[parent].children.iter().copied().filter(is_named).collect();
                for predicate in predicates.split_terminator(']') {
                    children = self.filtered(children, predicate.strip_prefix('[')?.trim())?;
                }
                next.extend(children);
            }
            (found, rest) = (next, behind);
        }
        Some(found)
    }

    fn with_descendants(&self, from: &[Id]) -> Vec<Id> {
        // Elements follow their parents in the list, and each has one parent, so that none is met twice.
        let mut all = from.to_vec();
        let mut at = 0;
        while at < all.len() {
            all.extend_from_slice(&self.nodes[all[at]].children);
            at += 1;
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    /// What a predicate of XPath leaves: a number from 1, `@Name="mesh"`, `self::Topology or self::Geometry`.
    fn filtered(&self, elements: Vec<Id>, predicate: &str) -> Option<Vec<Id>> {
        if let Ok(number) = predicate.parse::<usize>() {
            return Some(number.checked_sub(1).and_then(|i| elements.get(i)).copied().into_iter().collect());
        }
        if let Some((attribute, value)) = predicate.strip_prefix('@').and_then(|rest| rest.split_once('=')) {
            let value = value.trim().trim_matches(['"', '\'']);
            return Some(elements.into_iter().filter(|&id| self.get(id, attribute.trim()) == Some(value)).collect());
        }
        let names: Option<Vec<&str>> = predicate.split(" or ").map(|name| name.trim().strip_prefix("self::")).collect();
        let names = names?;
        Some(elements.into_iter().filter(|&id| names.contains(&self.name(id))).collect())
    }
}

/// A path's first step and what is behind the slash after it; slashes in brackets are the step's.
fn split_step(path: &str) -> (&str, &str) {
    let mut depth = 0usize;
    for (i, c) in path.char_indices() {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            '/' if depth == 0 => return (&path[..i], &path[i + 1..]),
            _ => {}
        }
    }
    (path, "")
}

impl Node {
    fn new(tag: &BytesStart<'_>) -> Result<Self, String> {
        let mut attributes = Vec::new();
        for attribute in tag.attributes().with_checks(false) {
            if attributes.len() == ATTRIBUTES_LIMIT {
                return Err(format!("a tag with more than {ATTRIBUTES_LIMIT} attributes"));
            }
            let attribute = attribute.map_err(|e| e.to_string())?;
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| e.to_string())?;
            attributes.push((AsRef::<str>::as_ref(&attribute.key).to_owned(), value.into_owned()));
        }
        let name = tag.name();
        let name = AsRef::<str>::as_ref(&name);
        let name = name.rsplit_once(':').map_or(name, |(_, name)| name).to_owned();
        Ok(Node { name, attributes, ..Node::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<?xml version='1.0'?><!DOCTYPE Xdmf SYSTEM 'Xdmf.dtd' []><Xdmf><Domain><Grid Name='a/b'><Topology/><Time/><Geometry/></Grid>\
                        <Grid Name='c'><Grid><x:include>1 &lt; 2 <!-- no --><![CDATA[&]]></x:include></Grid><Grid Name='d'/></Grid></Domain></Xdmf>";

    #[test]
    fn paths_lead_to_elements() {
        let tree = Tree::parse(TEXT).expect("sound");
        let names = |path: &str| {
            let found = tree.select(path)?;
            Some(found.into_iter().map(|id| tree.place(id)).collect::<Vec<_>>().join(" "))
        };
        for (path, expected) in [
            ("/Xdmf/Domain/Grid[1]/Topology", "<Topology>"),
            ("xpointer(//Grid[@Name=\"a/b\"]/*[self::Topology or self::Geometry])", "<Topology> <Geometry>"),
            ("//Grid", "<Grid> \"a/b\" <Grid> \"c\" <Grid> <Grid> \"d\""),
            ("/Xdmf/Domain/Grid[@Name='c'][1]/Grid[2]", "<Grid> \"d\""),
            ("//Grid[@Name='c']/Grid[1]/include", "<include>"),
            ("//Grid[0]", ""),
            ("/Xdmf/Nowhere/Grid", ""),
        ] {
            assert_eq!(names(path).as_deref(), Some(expected), "{path}");
        }
        assert_eq!(names("//Grid[last()]"), None);
        let include = tree.select("//include").expect("known")[0];
        assert_eq!(tree.text(include), "1 < 2 &");
    }

    #[test]
    fn hostile_markup_is_refused() {
        let deep = "<a>".repeat(1000);
        let broad = format!("<a {}/>", "b='' ".repeat(1000));
        let entities = "<!DOCTYPE x [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;'>]><x>&b;</x>";
        for (text, expected) in [
            (&deep[..], "more than 50 open elements"),
            (&broad, "more than 100 attributes"),
            (entities, "the entity \"b\""),
            ("<a b='&c;'/>", "unrecognized entity `c`"),
            ("<a><b></a>", "expected well-formed XML"),
            ("<a>", "the end of the file within <a>"),
            ("<a", "expected well-formed XML"),
        ] {
            let error = Tree::parse(text).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
