//! Files that are made to harm: scripts in their names and in what they say of themselves, and pictures that would fill
//! the memory.

use std::path::Path;

use serde_json::json;

use crate::attacks::{NO_PHOTOGRAPH, Place};
use crate::server::Server;

/// What would run, were it taken for part of a page.
const SCRIPT: &str = "<img src=x onerror=alert(1)><script>alert(2)</script>";

/// Scripts in names are text: they come as JSON, which no browser takes for a page.
#[test]
#[cfg(unix)]
fn scripts_in_names_are_text() {
    let place = Place::new();
    let name = "<img src=x onerror=alert(1)>.jpg";
    std::fs::write(place.open().join(name), NO_PHOTOGRAPH).expect("a file");
    let server = place.server();
    let answer = server.get("/api/news");
    assert!(answer.head.contains("content-type: application/json"), "{}", answer.head);
    let listed = answer.json()["photographs"].as_array().expect("photographs").clone();
    assert!(listed.iter().any(|one| one["name"] == name), "{listed:?}");
    // What cannot be read is said with its name, which is text, too.
    let number = listed.iter().position(|one| one["name"] == name).expect("there");
    let refused = server.get(&format!("/api/photographs/{number}/thumbnail"));
    assert!(refused.status == 422 && refused.head.contains("content-type: application/json"), "{refused:?}");
}

/// A photograph of the room that says `text` of its camera, of who took it, of what it shows and of whose it is.
fn saying(number: usize, text: &str) -> Vec<u8> {
    // EXIF 2.32, table 4: ImageDescription, Make, Model, Artist, Copyright.
    const TAGS: [u16; 5] = [0x010e, 0x010f, 0x0110, 0x013b, 0x8298];
    const ENTRY: usize = 12;
    let text = format!("{text}\0");
    let count = u32::try_from(text.len()).expect("short");
    // After the header, the number of entries, these, and the place of no next directory.
    let texts = 8 + 2 + TAGS.len() * ENTRY + 4;
    let mut tiff = b"MM\0*\0\0\0\x08\0\x05".to_vec();
    for (position, tag) in TAGS.into_iter().enumerate() {
        let place = u32::try_from(texts + position * text.len()).expect("short");
        tiff.extend([tag.to_be_bytes(), 2_u16.to_be_bytes()].concat());
        tiff.extend([count.to_be_bytes(), place.to_be_bytes()].concat());
    }
    tiff.extend([0; 4]);
    TAGS.iter().for_each(|_| tiff.extend(text.as_bytes()));
    let body = [b"Exif\0\0".as_slice(), &tiff].concat();
    let length = u16::try_from(body.len() + 2).expect("short").to_be_bytes();
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/room/0{number}.jpg"));
    let photograph = std::fs::read(room).expect("a photograph");
    let (start, rest) = photograph.split_at(2);
    [start, b"\xff\xe1", &length, &body, rest].concat()
}

/// Whether a text, as it is or as JSON writes it, is among the bytes.
fn holds(bytes: &[u8], text: &str) -> bool {
    bytes.windows(text.len()).any(|window| window == text.as_bytes())
}

/// What photographs say of themselves comes as text, or not at all: small pictures are drawn anew, without it.
#[test]
fn scripts_in_what_photographs_say_are_text() {
    let desk = tempfile::tempdir().expect("a folder");
    for number in [0, 1] {
        let photograph = saying(number, SCRIPT);
        assert!(holds(&photograph, SCRIPT));
        std::fs::write(desk.path().join(format!("{number}.jpg")), photograph).expect("a file");
    }
    let server = Server::of(desk.path());
    let wishes = json!({ "options": { "canvas.scale": "0.1" } }).to_string();
    assert_eq!(server.post("/api/wishes", &wishes).status, 204);
    assert_eq!(server.post("/api/stitch", "").status, 202);
    let told = server.settled();
    assert_eq!(told["stitched"]["used"], 2, "{told}");
    let preview = server.post("/api/preview", "{}").json();
    for path in ["/api/photographs/0/thumbnail".to_owned(), format!("/api/preview/{}", preview["number"])] {
        let answer = server.get(&path);
        assert!(answer.head.contains("content-type: image/jpeg"), "{path}: {}", answer.head);
        assert!(answer.head.contains("x-content-type-options: nosniff"), "{path}: {}", answer.head);
        assert!(!holds(&answer.body, "<script>"), "{path}");
    }
    for path in ["/api/news", "/api/options"] {
        let answer = server.get(path);
        assert!(answer.head.contains("content-type: application/json"), "{path}: {}", answer.head);
    }
    // A project is a file to be saved.
    let project = server.get("/api/project");
    assert!(project.head.contains("content-disposition: attachment"), "{}", project.head);
    let drawing = server.get(&format!("/api/preview/{}/layers/outlines", preview["number"]));
    assert!(drawing.head.contains("content-type: application/json") && !holds(&drawing.body, "<script>"));
}

/// The first bytes of a PNG that says it has so many pixels, and none of them.
fn bomb(side: u32) -> Vec<u8> {
    let side = side.to_be_bytes();
    let header = [b"IHDR".as_slice(), &side, &side, b"\x08\x06\0\0\0"].concat();
    // CRC-32 as in PNG, section D: reflected, of 0xedb88320.
    let crc = !header.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 })
    });
    [b"\x89PNG\r\n\x1a\n\0\0\0\x0d".as_slice(), &header, &crc.to_be_bytes()].concat()
}

/// A file of some bytes that says it has 10 thousand million pixels is refused before any memory is taken.
#[test]
fn pictures_that_would_fill_the_memory_are_refused() {
    let place = Place::new();
    let server = place.server();
    assert_eq!(server.with_body("PUT", "/api/photographs?name=bomb.png", &bomb(100_000)).status, 201);
    let refused = server.get("/api/photographs/1/thumbnail");
    assert_eq!(refused.status, 422, "{refused:?}");
    assert!(refused.text().contains("bomb.png"), "{refused:?}");
    assert_eq!(server.get("/api/news").status, 200, "it goes on");
}
