//! Everything that decks do, in small ones: widths, encodings, suffix cards, sets, parameters, includes.

use std::path::{Path, PathBuf};

use keyword_deck::{Clause, Deck, Error, Holds, Memory, Resolver, SetKind, Surface, SurfaceKind, Warning};

fn files(files: &[(&str, &str)]) -> Memory {
    Memory(files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect())
}

fn read(text: &str) -> Deck {
    read_bytes(text.as_bytes())
}

fn read_bytes(bytes: &[u8]) -> Deck {
    try_bytes(bytes).unwrap_or_else(|error| panic!("{error}"))
}

fn try_bytes(bytes: &[u8]) -> Result<Deck, Error> {
    Deck::read_from(&Memory([(PathBuf::from("a.k"), bytes.to_vec())].into()), Path::new("a.k"))
}

/// A card of right-aligned fields.
fn card(widths: &[usize], fields: &[&str]) -> String {
    fields.iter().zip(widths).map(|(field, &width)| format!("{field:>width$}")).collect::<String>() + "\n"
}

fn tens(fields: &[&str]) -> String {
    card(&[10; 8], fields)
}

fn eights(fields: &[&str]) -> String {
    card(&[8; 10], fields)
}

/// Three nodes and a triangle in every width, with ids that fill the narrow ones.
#[test]
fn every_width_reads_the_same_mesh() {
    let deck = |head: &str, suffix: &str, narrow: usize, wide: usize, comma: bool| {
        let line = |widths: &[usize], fields: &[&str]| match comma {
            true => fields.join(",") + "\n",
            false => card(widths, fields),
        };
        let mut text = format!("{head}\n*PART{}\nlid\n", suffix.replace('%', ""));
        text += &line(&[if narrow == 20 { 20 } else { 10 }; 3], &["7", "1", "1"]);
        text += &format!("*NODE{suffix}\n");
        for (id, [x, y, z]) in [
            ("10000001", ["-1.0", "0.0", "5.0"]),
            ("10000002", ["1.", "0", "5.0"]),
            ("10000003", ["0", "1.0D0", "+5."]),
        ] {
            text += &line(&[narrow, wide, wide, wide], &[id, x, y, z]);
        }
        text += &format!("*ELEMENT_SHELL{suffix}\n");
        text += &line(&[narrow; 5], &["1", "7", "10000001", "10000002", "10000003"]);
        read(&(text + "*END\nafter the end\n"))
    };
    let expected = deck("*KEYWORD", "", 8, 16, false);
    assert_eq!(expected.coordinates, [[-1.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]]);
    assert_eq!(expected.shells[0].nodes, [10000001, 10000002, 10000003, 10000003]);
    assert_eq!(expected.part_table()[0].elements.shells, 1);
    let same = |deck: Deck, what: &str| {
        assert_eq!(
            (deck.coordinates, deck.shells, deck.parts[0].id),
            (expected.coordinates.clone(), expected.shells.clone(), 7),
            "{what}"
        );
    };
    same(deck("*KEYWORD I10=Y", "", 10, 16, false), "I10=Y");
    same(deck("*KEYWORD", "%", 10, 16, false), "%");
    same(deck("*KEYWORD", " %", 10, 16, false), "% behind a blank");
    same(deck("*KEYWORD LONG=Y", "", 20, 20, false), "LONG=Y");
    same(deck("*keyword long = y", "", 20, 20, false), "lower case, blanks");
    same(deck("*KEYWORD", "+", 20, 20, false), "+");
    same(deck("*KEYWORD LONG=Y", "-", 8, 16, false), "- in a long deck");
    same(deck("*KEYWORD LONG=S", "", 8, 16, false), "LONG=S, standard cards");
    same(deck("*KEYWORD LONG=S", "", 20, 20, false), "LONG=S, long cards");
    same(deck("*KEYWORD", "", 8, 16, true), "commas");
    same(deck("*KEYWORD LONG=Y", "", 20, 20, true), "commas in a long deck");
    same(deck("$ a comment\n\n*KEYWORD", "", 8, 16, false), "something in front");
}

#[test]
fn line_ends_and_encodings() {
    let text = "*KEYWORD\n*PART\nT\u{fc}r\n         1         1         1\n*NODE\n       1             1.0             2.0             3.0\n";
    let expected = read(text);
    assert_eq!(expected.parts[0].title, "Tür");
    for ends in ["\r\n", "\r"] {
        let other = read(&text.replace('\n', ends));
        assert_eq!((other.parts, other.coordinates), (expected.parts.clone(), expected.coordinates.clone()));
    }
    let with_mark = [b"\xef\xbb\xbf", text.as_bytes()].concat();
    assert_eq!(read_bytes(&with_mark).parts, expected.parts);
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    assert_eq!(read_bytes(&latin).parts[0].title, "Tür");
    // GBK (车门): no UTF-8, so every byte is a character, and none is lost.
    let gbk = [b"*PART\n", &[0xb3, 0xb5, 0xc3, 0xc5][..], b"\n         1         1         1\n"].concat();
    let bytes: Vec<u8> = read_bytes(&gbk).parts[0].title.chars().map(|c| c as u8).collect();
    assert_eq!(bytes, [0xb3, 0xb5, 0xc3, 0xc5]);
}

#[test]
fn shells_with_every_suffix_card() {
    let thickness = card(&[16; 5], &["1.0", "2.0", "3.0", "4.0", "45.0"]);
    let middle = card(&[16; 4], &["1.0", "1.0", "1.0", "1.0"]);
    let offset = card(&[16], &["0.5"]);
    let dof = eights(&["", "", "1", "2", "3", "4"]);
    let plies = tens(&["5", "0.25", "0.0", "", "6", "0.5", "90.0"]) + &tens(&["5", "0.25", "0.0"]);
    for (options, cards, edges) in [
        ("", String::new(), false),
        ("_THICKNESS", thickness.clone(), false),
        ("_THICKNESS", thickness.clone() + &middle, true),
        ("_BETA", thickness.clone(), false),
        ("_MCID", thickness.clone(), false),
        ("_OFFSET", offset.clone(), false),
        ("_DOF", dof.clone(), false),
        ("_THICKNESS_OFFSET", thickness.clone() + &offset, false),
        ("_BETA_OFFSET_COMPOSITE", thickness.clone() + &offset + &plies, false),
        ("_COMPOSITE", plies.clone(), false),
        ("_COMPOSITE_LONG", tens(&["5", "0.25", "0.0", "", "1"]) + &tens(&["6", "0.75", "0.0", "", "2"]), false),
        ("_SHL4_TO_SHL8", String::new(), false),
    ] {
        let edge_nodes = if edges { ["5", "6", "7", "8"] } else { ["", "", "", ""] };
        let mut text = format!("*ELEMENT_SHELL{options}\n");
        for id in ["11", "12"] {
            text += &eights(&[&[id, "3", "1", "2", "3", "4"][..], &edge_nodes[..]].concat());
            text += &cards;
        }
        let deck = read(&text);
        let ids: Vec<u64> = deck.shells.iter().map(|shell| shell.id).collect();
        assert_eq!(ids, [11, 12], "{options}");
        assert!(deck.shells.iter().all(|shell| shell.nodes == [1, 2, 3, 4]), "{options}");
        let sum = Resolver::new(&deck).shell_thickness(1);
        let expected = match options {
            _ if options.contains("THICKNESS") || options.contains("BETA") || options == "_MCID" => 2.5,
            _ if options.contains("COMPOSITE") => 1.0,
            _ => 0.0,
        };
        assert!((sum - expected).abs() < 1e-12, "{options}: {sum}");
        if options.contains("OFFSET") {
            assert_eq!(deck.shell_cards[1].offset, Some(0.5), "{options}");
        }
    }
    let splines = read("*ELEMENT_SHELL_NURBS_PATCH\n       1       1\n");
    assert!(splines.shells.is_empty() && splines.warnings[0].kind() == "not-followed");
}

#[test]
fn solids_thick_shells_and_beams() {
    let ids = |from: usize, count: usize| -> String {
        let all: Vec<String> = (from..from + count).map(|id| id.to_string()).collect();
        all.chunks(10).map(|ten| eights(&ten.iter().map(String::as_str).collect::<Vec<_>>())).collect()
    };
    for (options, node_cards, extra, corners) in [
        ("", None, 0, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("", Some(8), 0, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("", Some(10), 0, [1, 2, 3, 4, 4, 4, 4, 4]),
        ("", Some(4), 0, [1, 2, 3, 4, 4, 4, 4, 4]),
        ("_TET4TOTET10", Some(4), 0, [1, 2, 3, 4, 4, 4, 4, 4]),
        ("_ORTHO", None, 2, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("_ORTHO_DOF", Some(8), 3, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("_H20", Some(20), 0, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("_H27", Some(27), 0, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("_H64", Some(64), 0, [1, 2, 3, 4, 5, 6, 7, 8]),
        ("_P21", Some(21), 0, [1, 2, 3, 4, 5, 6, 6, 6]),
        ("_T15", Some(15), 0, [1, 2, 3, 4, 4, 4, 4, 4]),
    ] {
        let mut text = format!("*ELEMENT_SOLID{options}\n");
        for id in ["11", "12"] {
            text += &match node_cards {
                None => eights(&[id, "3", "1", "2", "3", "4", "5", "6", "7", "8"]),
                Some(count) => eights(&[id, "3"]) + &ids(1, count),
            };
            text += &card(&[16; 3], &["1.0", "0.0", "0.0"]).repeat(extra);
        }
        let deck = read(&text);
        assert_eq!(deck.solids.len(), 2, "{options} {node_cards:?}");
        assert!(
            deck.solids.iter().all(|solid| solid.nodes == corners && solid.part == 3),
            "{options}: {:?}",
            deck.solids
        );
    }
    let row = eights(&["1", "3", "1", "2", "3", "4", "5", "6", "7", "8"]);
    let beta = card(&[16; 5], &["", "", "", "", "30.0"]);
    assert_eq!(read(&format!("*ELEMENT_TSHELL\n{row}{row}")).thick_shells.len(), 2);
    assert_eq!(read(&format!("*ELEMENT_TSHELL_BETA\n{row}{beta}{row}{beta}")).thick_shells.len(), 2);
    let plies = tens(&["5", "0.25", "0.0", "", "6", "0.5", "90.0"]);
    assert_eq!(read(&format!("*ELEMENT_TSHELL_COMPOSITE\n{row}{plies}{plies}{row}{plies}")).thick_shells.len(), 2);
    let beam = eights(&["1", "3", "1", "2", "3"]);
    for options in ["THICKNESS", "SCALAR", "SECTION", "PID", "OFFSET", "ORIENTATION", "WARPAGE", "ELBOW", "PID_OFFSET"]
    {
        let extra = tens(&["1", "2"]).repeat(options.split('_').count());
        let deck = read(&format!("*ELEMENT_BEAM_{options}\n{beam}{extra}{beam}{extra}"));
        assert_eq!(deck.beams.len(), 2, "{options}");
        assert_eq!(deck.beams[1].nodes, [1, 2], "{options}");
    }
    let counted =
        read("*ELEMENT_MASS\n       1       1             0.5\n*ELEMENT_SPH\n       1       1\n       2       1\n");
    assert_eq!((counted.other_elements["MASS"], counted.other_elements["SPH"]), (1, 2));
}

#[test]
fn parts_with_every_option() {
    let plain = tens(&["7", "2", "3"]);
    let inertia = tens(&["0.0"]).repeat(3);
    let contact = tens(&["0.1", "0.1", "0.0", "0.0", "1.5"]);
    for (options, cards) in [
        ("", String::new()),
        ("_INERTIA", inertia.clone()),
        ("_INERTIA", tens(&["0.", "0.", "0.", "1.", "1"]) + &tens(&["0.0"]).repeat(3)),
        ("_CONTACT", contact.clone()),
        ("_REPOSITION", tens(&["1", "1", "0"])),
        ("_PRINT", tens(&["1"])),
        ("_ATTACHMENT_NODES", tens(&["1"])),
        ("_INERTIA_CONTACT_PRINT", inertia + &contact + &tens(&["1"])),
    ] {
        let one = |title: &str| format!("{title}\n{plain}{cards}");
        let two = one("first, with a comma") + &one("second").replacen("         7", "         8", 1);
        let deck = read(&format!("*PART{options}\n{two}"));
        let found: Vec<(u64, &str, u64, u64)> =
            deck.parts.iter().map(|part| (part.id, part.title.as_str(), part.section, part.material)).collect();
        assert_eq!(found, [(7, "first, with a comma", 2, 3), (8, "second", 2, 3)], "{options}");
    }
    let composite = "*PART_COMPOSITE\nroof\n".to_owned()
        + &tens(&["7", "2", "0.83", "0.0"])
        + &tens(&["5", "0.25", "0.0", "", "6", "0.5", "90.0"])
        + &tens(&["5", "0.25", "0.0"]);
    assert_eq!(read(&composite).parts[0].thickness, Some(1.0));
    // A blank title is a title; a lone line behind the last part is none.
    let blank = format!("*PART\n\n{plain}\n*NODE\n");
    assert_eq!(read(&blank).parts.len(), 1);
    let moved = read("*PART_MOVE\n       7             1.0\n");
    assert_eq!((moved.warnings[0].kind(), moved.skipped["PART_MOVE"].cards), ("not-followed", 1));
}

#[test]
fn sections_and_materials() {
    let text = "*SECTION_SHELL_TITLE\nroof\n".to_owned()
        + &tens(&["1", "16", "0.833", "3", "0", "0", "1"])
        + &tens(&["1.5", "1.5", "1.5", "1.5"])
        + &tens(&["0.0", "45.0", "90.0"])
        + "floor\n"
        + &tens(&["2", "2"])
        + &tens(&["0.8"])
        + "*SECTION_BEAM\n"
        + &tens(&["3", "9"])
        + &tens(&["6.0", "5.0"])
        + "*SECTION_SOLID\n"
        + &tens(&["4", "1"])
        + &tens(&["5", "20"])
        + "*MAT_SPOTWELD_TITLE\nspots\n"
        + &tens(&["9", "7.8e-6"])
        + "*MAT_024\n"
        + &tens(&["10", "7.8e-6"])
        + "*PART\nweld\n"
        + &tens(&["1", "3", "9"]);
    let deck = read(&text);
    let found: Vec<(u64, &str, i64)> =
        deck.sections.iter().map(|section| (section.id, section.title.as_str(), section.formulation)).collect();
    assert_eq!(found, [(1, "roof", 16), (2, "floor", 2), (3, "", 9), (4, "", 1), (5, "", 20)]);
    assert_eq!(deck.sections[1].thickness, Some([0.8; 4]));
    let resolver = Resolver::new(&deck);
    assert_eq!(
        (resolver.material(1), resolver.formulation(1), resolver.part_thickness(1)),
        (Some("MAT_SPOTWELD"), 9, Some(6.0))
    );
}

#[test]
fn sets_of_every_form() {
    let mut text = String::from("*NODE\n");
    for id in 1..=30 {
        text += &card(&[8, 16, 16, 16], &[&id.to_string(), "0.0", "0.0", "0.0"]);
    }
    text += "*ELEMENT_SHELL\n";
    text += &eights(&["1", "7", "1", "2", "3", "4"]);
    text += &eights(&["2", "8", "3", "4", "5", "6"]);
    text += &("*SET_NODE_LIST\n".to_owned() + &tens(&["1"]) + &tens(&["5", "3", "0", "5"]));
    text += &("*SET_NODE_LIST_GENERATE_TITLE\nrange\n".to_owned() + &tens(&["2"]) + &tens(&["10", "12", "20", "20"]));
    text += &("*SET_NODE_LIST_GENERATE_INCREMENT\n".to_owned() + &tens(&["3"]) + &tens(&["1", "9", "4"]));
    text += &("*SET_NODE_COLUMN\n".to_owned() + &tens(&["4"]) + &tens(&["29"]) + &tens(&["28"]));
    text += &("*SET_NODE_ADD\n".to_owned() + &tens(&["5"]) + &tens(&["1", "4"]));
    text += &("*SET_NODE_INTERSECT\n".to_owned() + &tens(&["6"]) + &tens(&["1", "3"]));
    text += &("*SET_NODE_GENERAL\n".to_owned()
        + &tens(&["7"])
        + &tens(&["PART", "8"])
        + &tens(&["DNODE", "5"])
        + &tens(&["NODE", "30"]));
    text += &("*SET_NODE_ADD\n".to_owned() + &tens(&["8"]) + &tens(&["8", "1"]));
    text += &("*SET_SEGMENT\n".to_owned() + &tens(&["1"]) + &tens(&["1", "2", "3", "4"]) + &tens(&["5", "6", "7"]));
    text += &("*SET_PART_LIST_GENERATE\n".to_owned() + &tens(&["1"]) + &tens(&["1", "7"]));
    text += &("*SET_SHELL_GENERAL\n".to_owned() + &tens(&["1"]) + &tens(&["ALL"]) + &tens(&["DELEM", "1"]));
    text += &("*SET_NODE_GENERAL\n".to_owned() + &tens(&["9"]) + &tens(&["BOX", "1"]));
    text += &("*SET_NODE_ADD_ADVANCED\n".to_owned() + &tens(&["10"]) + &tens(&["1", "1", "1", "2"]));
    let deck = read(&text);
    let mut resolver = Resolver::new(&deck);
    let mut nodes = |id: u64| resolver.ids(SetKind::Nodes, id).into_iter().collect::<Vec<u64>>();
    assert_eq!(nodes(1), [3, 5]);
    assert_eq!(nodes(2), [10, 11, 12, 20]);
    assert_eq!(nodes(3), [1, 5, 9]);
    assert_eq!(nodes(4), [28, 29]);
    assert_eq!(nodes(5), [3, 5, 28, 29]);
    assert_eq!(nodes(6), [5]);
    assert_eq!(nodes(7), [3, 4, 6, 30]);
    assert_eq!(nodes(8), [3, 5], "a set that contains itself ends");
    assert_eq!(nodes(9), [0u64; 0]);
    assert_eq!(nodes(10), [3, 4, 5, 6]);
    assert_eq!(nodes(99), [0u64; 0]);
    let words: Vec<String> = resolver.unresolved.iter().map(ToString::to_string).collect();
    assert_eq!(words.len(), 3, "{words:?}");
    let faces = |resolver: &mut Resolver<'_>, kind: SurfaceKind, id: u64| -> Vec<[u64; 4]> {
        resolver.faces(Surface { kind, id }).into_iter().map(|face| face.nodes).collect()
    };
    assert_eq!(faces(&mut resolver, SurfaceKind::Segments, 1), [[1, 2, 3, 4], [5, 6, 7, 7]]);
    assert_eq!(faces(&mut resolver, SurfaceKind::Shells, 1), [[3, 4, 5, 6]]);
    assert_eq!(faces(&mut resolver, SurfaceKind::Parts, 1), [[1, 2, 3, 4]]);
    assert_eq!(faces(&mut resolver, SurfaceKind::Part, 8), [[3, 4, 5, 6]]);
    assert_eq!(faces(&mut resolver, SurfaceKind::AllBut, 1), [[3, 4, 5, 6]]);
    assert_eq!(faces(&mut resolver, SurfaceKind::All, 0).len(), 2);
    assert!(matches!(&deck.sets[1].clauses[0], Clause::Range { first: 10, last: 12, step: 1 }));
}

#[test]
fn welds_and_ties() {
    let text = "*CONSTRAINED_SPOTWELD\n".to_owned()
        + &tens(&["1", "2", "0.0"])
        + &tens(&["3", "4"])
        + "*CONSTRAINED_SPOTWELD_ID\n"
        + &tens(&["77"])
        + &tens(&["5", "6"])
        + "*CONSTRAINED_SPOTWELD_FILTERED_FORCE\n"
        + &tens(&["7", "8"])
        + &tens(&["3", "0.1"])
        + "*CONSTRAINED_RIVET\n"
        + &tens(&["9", "10"])
        + "*CONSTRAINED_NODE_SET_ID\n"
        + &tens(&["5"])
        + &tens(&["50", "7"])
        + "*CONSTRAINED_NODAL_RIGID_BODY_INERTIA_TITLE\nbolt\n"
        + &tens(&["60", "0", "61"])
        + &tens(&["0.0"]).repeat(3)
        + "*CONSTRAINED_NODAL_RIGID_BODY\n"
        + &tens(&["62"])
        + &tens(&["63", "0", "64"])
        + "*CONSTRAINED_GENERALIZED_WELD_SPOT\n"
        + &tens(&["70"])
        + &tens(&["1e20"])
        + "*CONSTRAINED_TIED_NODES_FAILURE\n"
        + &tens(&["71", "0.1"])
        + "*CONSTRAINED_INTERPOLATION_SPOTWELD\n"
        + &tens(&["1", "2", "72", "2.0", "5.0"])
        + &tens(&["1.0"])
        + "*CONTACT_TIED_SHELL_EDGE_TO_SURFACE_BEAM_OFFSET_ID\n"
        + "        12rim to lid\n"
        + &tens(&["1", "2", "4", "3"])
        + &tens(&["0.0"])
        + &tens(&["0.0", "0.0", "-1.5", "-2.5"])
        + "*CONTACT_SPOTWELD_MPP\n"
        + &tens(&["0"])
        + "&        1\n"
        + &tens(&["3", "4", "3", "2"])
        + "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_TIEBREAK\n"
        + &tens(&["5", "6", "0", "1"])
        + "*CONTACT_AUTOMATIC_SINGLE_SURFACE\n"
        + &tens(&["0"])
        + "*CONSTRAINED_JOINT_REVOLUTE\n"
        + &tens(&["1", "2"]);
    let deck = read(&text);
    let held: Vec<(u64, Holds)> = deck.connections.iter().map(|connection| (connection.id, connection.holds)).collect();
    assert_eq!(
        held,
        [
            (0, Holds::Nodes([1, 2])),
            (0, Holds::Nodes([3, 4])),
            (77, Holds::Nodes([5, 6])),
            (0, Holds::Nodes([7, 8])),
            (0, Holds::Nodes([9, 10])),
            (5, Holds::NodeSet(50)),
            (60, Holds::NodeSet(61)),
            (62, Holds::NodeSet(62)),
            (63, Holds::NodeSet(64)),
            (0, Holds::NodeSet(70)),
            (0, Holds::CoincidentNodes(71)),
            (0, Holds::SheetsAt { parts: [1, 2], set: 72 }),
        ]
    );
    assert_eq!(deck.ties.len(), 3);
    assert_eq!(
        (deck.ties[0].id, deck.ties[0].title.as_str(), deck.ties[0].thickness),
        (12, "rim to lid", [-1.5, -2.5])
    );
    let surface = |kind, id| Surface { kind, id };
    assert_eq!(deck.ties[0].surfaces, [surface(SurfaceKind::Nodes, 1), surface(SurfaceKind::Part, 2)]);
    assert_eq!(deck.ties[1].surfaces, [surface(SurfaceKind::Part, 3), surface(SurfaceKind::Parts, 4)]);
    assert_eq!(deck.ties[2].surfaces, [surface(SurfaceKind::Segments, 5), surface(SurfaceKind::Shells, 6)]);
    let skipped: Vec<&str> = deck.skipped.keys().map(String::as_str).collect();
    assert_eq!(skipped, ["CONSTRAINED_JOINT_REVOLUTE", "CONTACT_AUTOMATIC_SINGLE_SURFACE"]);
}

#[test]
fn parameters_and_expressions() {
    let node = [8, 16, 16, 16];
    let text = "*PARAMETER\n".to_owned()
        + &tens(&["R gap     ", "2.0", "I n       ", "3"])
        + "R,half\n"
        + &tens(&["C name    ", "roof"])
        + "*PARAMETER_EXPRESSION\nR top     gap*(n+\n          1)\nI m       7/2\n*PARAMETER_LOCAL\n"
        + &tens(&["R own     ", "9.0"])
        + "*NODE\n"
        + &card(&node, &["1", "&gap", "-&gap", "&top"])
        + "       2,<&gap/2>,&own,<max(&n,&m)>\n";
    let deck = read(&text.replace("R,half\n", ""));
    assert_eq!(deck.coordinates, [[2.0, -2.0, 8.0], [1.0, 9.0, 3.0]]);
    assert_eq!(deck.parameters, 5);
    // A definition that cannot be read costs a warning; a name that is then missing where the mesh needs it is an error.
    let broken =
        read("*PARAMETER\nX a             1.0\n*NODE\n       1             1.0             0.0             0.0\n");
    assert_eq!(broken.warnings[0].kind(), "bad-card");
    let missing = try_bytes(
        b"*PARAMETER_EXPRESSION\nR a       foo(1)\n*NODE\n       1              &a             0.0             0.0\n",
    );
    assert!(missing.unwrap_err().to_string().contains("a.k:4: *NODE: the parameter '&a' has no definition"));
}

#[test]
fn includes_are_found_moved_and_named() {
    let node = "*NODE\n       1             1.0             0.0             0.0\n";
    let transform = |name: &str, transformation: &str| {
        format!("*INCLUDE_TRANSFORM\n{name}\n")
            + &tens(&["100", "200", "300", "400", "500", "0", "7"])
            + &tens(&["600", "", "left", "old"])
            + &tens(&["1.0", "1.0", "10.0"])
            + &tens(&[transformation])
    };
    let main = "*KEYWORD\n*INCLUDE\nplain.k\n*INCLUDE_PATH\nlibrary\n*INCLUDE\na very long +\nname.k\n*INCLUDE\nsub\\windows.k\n*DEFINE_TRANSFORMATION\n".to_owned()
        + &tens(&["5"])
        + &tens(&["TRANSL", "0.0", "0.0", "1.0"])
        + &transform("placed.k", "5")
        + "*INCLUDE\nnowhere.k\n*END\n";
    let placed = "*NODE\n       1             1.0             0.0             0.0\n*ELEMENT_SHELL_THICKNESS\n"
        .to_owned()
        + &eights(&["1", "7", "1", "1", "1", "0"])
        + &card(&[16; 4], &["0.1", "0.1", "0.1", "0.1"])
        + "*PART\ndoor\n"
        + &tens(&["7", "2", "3"])
        + "*SET_NODE_LIST\n"
        + &tens(&["9"])
        + &tens(&["1"])
        + "*DEFINE_TRANSFORMATION\n"
        + &tens(&["1"])
        + &tens(&["ROTATE", "0.0", "0.0", "1.0", "0.0", "0.0", "0.0", "90.0"])
        + &transform("inner.k", "1");
    let all = files(&[
        ("run/main.k", &main),
        ("run/plain.k", &node.replace("       1 ", "       2 ")),
        ("run/library/a very longname.k", &node.replace("       1 ", "       3 ")),
        ("run/sub/windows.k", &(node.replace("       1 ", "       4 ") + "*INCLUDE\nbeside.k\n")),
        ("run/sub/beside.k", &node.replace("       1 ", "       5 ")),
        ("run/placed.k", &placed),
        ("run/inner.k", node),
    ]);
    let deck = Deck::read_from(&all, Path::new("run/main.k")).unwrap();
    assert_eq!(deck.node_ids, [2, 3, 4, 5, 101, 201]);
    // 1 mm becomes 10 and rises by 1; the inner node is first scaled and turned, then scaled and raised.
    let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-12);
    assert!(
        close(deck.coordinates[4], [10.0, 0.0, 1.0]) && close(deck.coordinates[5], [0.0, 100.0, 1.0]),
        "{:?}",
        deck.coordinates
    );
    assert_eq!((deck.shells[0].id, deck.shells[0].part, deck.shells[0].nodes[0]), (201, 307, 101));
    assert_eq!(deck.shell_cards[0].thickness, Some([1.0; 4]));
    assert_eq!((deck.parts[0].id, deck.parts[0].section, deck.parts[0].material), (307, 602, 403));
    assert_eq!(deck.parts[0].title, "left.door.old");
    assert_eq!((deck.sets[0].id, &deck.sets[0].clauses[0]), (509, &Clause::Ids(vec![101])));
    let [Warning::MissingInclude { place, name, searched }] = &deck.warnings[..] else { panic!("{:?}", deck.warnings) };
    assert_eq!((place.to_string().as_str(), name.as_str()), ("run/main.k:21", "nowhere.k"));
    assert_eq!(searched, &[PathBuf::from("run/nowhere.k"), PathBuf::from("run/library/nowhere.k")]);
    assert_eq!(deck.files.len(), 7);
}

#[test]
fn the_same_file_twice_is_two_copies() {
    let main = "*KEYWORD\n".to_owned()
        + &["0", "10"]
            .map(|offset| format!("*INCLUDE_TRANSFORM\nwheel.k\n{}", tens(&[offset, offset, offset])))
            .concat();
    let wheel = "*NODE\n       1             1.0             0.0             0.0\n";
    let deck = Deck::read_from(&files(&[("main.k", &main), ("wheel.k", wheel)]), Path::new("main.k")).unwrap();
    assert_eq!(deck.node_ids, [1, 11]);
}

#[test]
fn a_transformation_that_is_not_there_is_said() {
    let main = "*INCLUDE_TRANSFORM\nwheel.k\n".to_owned() + "\n\n\n" + &tens(&["3"]);
    let wheel = "*NODE\n       1             1.0             0.0             0.0\n";
    let deck = Deck::read_from(&files(&[("main.k", &main), ("wheel.k", wheel)]), Path::new("main.k")).unwrap();
    assert_eq!(deck.coordinates, [[1.0, 0.0, 0.0]]);
    assert_eq!(
        deck.warnings[0].to_string(),
        "main.k:2: the transformation 3 is not defined; the nodes of this include stay where its file has them"
    );
}
