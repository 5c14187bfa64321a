//! Everything that somebody who is not meant to could try, and what comes of it: a refusal.

use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::server::{Server, answer};

/// A photograph of 32 x 24 pixels would do; nobody looks at these.
pub(crate) const NO_PHOTOGRAPH: &[u8] = b"\xff\xd8\xff\xe0 no photograph";
const EVIL: &str = "http://evil.example";

/// A folder with a photograph in it, beside one with a secret, and links from the one to the other.
pub(crate) struct Place {
    desk: tempfile::TempDir,
}

impl Place {
    pub(crate) fn new() -> Self {
        let desk = tempfile::tempdir().expect("a folder");
        for folder in ["open", "open/inside", "elsewhere"] {
            std::fs::create_dir(desk.path().join(folder)).expect("a folder");
        }
        for file in ["open/a.jpg", "open/inside/b.jpg", "elsewhere/secret.jpg", "elsewhere/secret.json"] {
            std::fs::write(desk.path().join(file), NO_PHOTOGRAPH).expect("a file");
        }
        #[cfg(unix)]
        for (to, from) in [
            ("elsewhere", "open/way"),
            ("elsewhere/secret.jpg", "open/link.jpg"),
            ("elsewhere/secret.json", "open/link.json"),
        ] {
            std::os::unix::fs::symlink(desk.path().join(to), desk.path().join(from)).expect("a link");
        }
        Self { desk }
    }

    pub(crate) fn open(&self) -> PathBuf {
        self.desk.path().join("open")
    }

    pub(crate) fn server(&self) -> Server {
        Server::of(&self.open())
    }

    /// Fails the test if anything is in a folder but what was there.
    pub(crate) fn expect_untouched(&self) {
        let names = |folder: &Path| {
            let entries =
                std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("readable").file_name());
            let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
            names.sort();
            names
        };
        let links: &[&str] =
            if cfg!(unix) { &["a.jpg", "inside", "link.jpg", "link.json", "way"] } else { &["a.jpg", "inside"] };
        assert_eq!(names(&self.open()), links);
        assert_eq!(names(&self.desk.path().join("elsewhere")), ["secret.jpg", "secret.json"]);
        assert_eq!(names(self.desk.path()), ["elsewhere", "open"]);
    }
}

/// Whoever has no key gets nothing: no page, no script, no word of what there is.
#[test]
fn nobody_gets_in_without_the_key() {
    let place = Place::new();
    let server = place.server();
    let wrong = format!("/?token={}", "0".repeat(64));
    for path in
        ["/", "/page/page.js", "/api/news", "/api/photographs/0/thumbnail", "/?token=", &wrong, "/?other=1", "/login"]
    {
        for cookie in [
            "",
            "Cookie: trueup=1\r\n",
            &format!("Cookie: trueup-{}={}\r\n", server.host.rsplit_once(':').expect("a port").1, "0".repeat(64)),
        ] {
            let answer = server.send(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\n{cookie}\r\n", server.host));
            assert_eq!(answer.status, 403, "{path} {cookie}");
            assert!(!answer.text().contains("a.jpg") && !answer.head.contains("set-cookie"), "{answer:?}");
        }
    }
}

/// A page elsewhere that has its own name point to this machine is refused by that name.
#[test]
fn other_names_of_the_server_are_refused() {
    let place = Place::new();
    let server = place.server();
    let port = server.host.rsplit_once(':').expect("a port").1;
    let other_port = "127.0.0.1:1";
    for host in [
        "evil.example",
        &format!("evil.example:{port}"),
        "127.0.0.1",
        other_port,
        &format!("127.0.0.2:{port}"),
        &format!("localhost.evil.example:{port}"),
        "",
    ] {
        let answer =
            server.send(&format!("GET /api/news HTTP/1.1\r\nHost: {host}\r\nCookie: {}\r\n\r\n", server.cookie));
        assert!(matches!(answer.status, 400 | 421), "{host}: {answer:?}");
    }
    let twice = format!(
        "GET /api/news HTTP/1.1\r\nHost: {}\r\nHost: evil.example\r\nCookie: {}\r\n\r\n",
        server.host, server.cookie
    );
    assert!(matches!(server.send(&twice).status, 400 | 421));
    let none = format!("GET /api/news HTTP/1.0\r\nCookie: {}\r\n\r\n", server.cookie);
    assert!(matches!(server.send(&none).status, 400 | 421));
    let localhost = format!("GET /api/news HTTP/1.1\r\nHost: localhost:{port}\r\nCookie: {}\r\n\r\n", server.cookie);
    assert_eq!(server.send(&localhost).status, 200);
}

/// A page elsewhere can make a browser send requests with the session, and is told by where they come from.
#[test]
fn requests_of_other_pages_are_refused() {
    let place = Place::new();
    let server = place.server();
    let body = "Content-Length: 2\r\n";
    let port: u16 = server.host.rsplit_once(':').expect("a port").1.parse().expect("a number");
    let neighbor = format!("http://127.0.0.1:{}", port ^ 1);
    for origin in [
        "",
        &format!("Origin: {EVIL}\r\n"),
        "Origin: null\r\n",
        &format!("Origin: {neighbor}\r\n"),
        &format!("Origin: https://{}\r\n", server.host),
    ] {
        for path in ["/api/undo", "/api/stitch", "/api/wishes", "/api/exports", "/api/folder"] {
            let answer = server.send(&format!("{}{{}}", server.head("POST", path, &format!("{origin}{body}"))));
            assert_eq!(answer.status, 403, "{path} {origin}");
        }
    }
    let looked = server.send(&server.head("GET", "/api/news", &format!("Origin: {EVIL}\r\n")));
    assert_eq!(looked.status, 403);
    for site in ["cross-site", "same-site"] {
        let embedded =
            server.send(&server.head("GET", "/api/photographs/0/thumbnail", &format!("Sec-Fetch-Site: {site}\r\n")));
        assert_eq!(embedded.status, 403, "{site}");
    }
    assert_eq!(server.post("/api/undo", "").status, 204, "the page itself may");
}

/// Answers, refusals too, let no script in but this program's own, and no page around them.
#[test]
fn every_answer_protects_itself() {
    let place = Place::new();
    let server = place.server();
    let refused = server.send(&format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", server.host));
    for answer in [server.get("/"), server.get("/api/news"), server.get("/none"), refused] {
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "x-content-type-options: nosniff",
            "cache-control: no-store",
            "x-frame-options: DENY",
        ] {
            assert!(answer.head.contains(line), "{line} is not in {}", answer.head);
        }
        assert!(
            !answer.head.contains("unsafe") && !answer.head.to_lowercase().contains("access-control"),
            "{}",
            answer.head
        );
    }
    let page = server.get("/").text();
    assert!(!page.contains("<style") && !page.contains("style=") && !page.contains("javascript:"), "{page}");
    assert!(
        page.matches("<script").count() == page.matches("<script src=\"/page/").count(),
        "scripts of our own: {page}"
    );
}

/// No request reaches a file that the page does not show.
#[test]
fn no_path_leads_out() {
    let place = Place::new();
    let server = place.server();
    for path in [
        "/page/../Cargo.toml",
        "/page/..%2f..%2fCargo.toml",
        "/page/%2e%2e/%2e%2e/etc/passwd",
        "/page//etc/passwd",
        "/api/tiles/1/panorama_files/0/..%2f..%2f..%2fsecret.jpg",
        "/api/tiles/0/panorama.dzi",
        "/api/exports/1/0",
        "/api/exports/1/..%2f..%2fa.jpg",
        "/api/preview/99",
        "/api/photographs/1/thumbnail",
        "/api/photographs/-1/thumbnail",
        "/api/photographs/..%2fa.jpg/thumbnail",
        "/api/photographs/0/mask/use",
        "/api/photographs/0/mask/..",
    ] {
        let answer = server.get(path);
        assert!(matches!(answer.status, 400 | 404), "{path}: {answer:?}");
    }
    let outside = place.desk.path().join("elsewhere").display().to_string();
    for folder in ["..", "../elsewhere", "way", "inside/../../elsewhere", "/", &outside, "a.jpg"] {
        let answer = server.post("/api/folder", &serde_json::json!({ "folder": folder }).to_string());
        assert_eq!(answer.status, 404, "{folder}");
    }
    for name in ["link.json", "../elsewhere/secret.json", "/etc/passwd"] {
        assert_eq!(server.post("/api/project", &serde_json::json!({ "name": name }).to_string()).status, 404, "{name}");
    }
    let told = server.get("/api/news").json();
    assert_eq!(told["photographs"].as_array().expect("photographs").len(), 1, "the link is not one: {told}");
    assert_eq!(told["folder"]["folders"], serde_json::json!(["inside"]));
    assert_eq!(server.post("/api/folder", r#"{"folder":"inside"}"#).status, 204);
    let told = server.get("/api/news").json();
    assert_eq!(told["photographs"][0]["name"], "b.jpg");
    assert_eq!(told["folder"]["inside"], "inside");
}

/// What is dropped lands on the desk under a plain name, or nowhere.
#[test]
fn uploads_have_plain_names_and_kinds() {
    let place = Place::new();
    let server = place.server();
    for name in [
        "../a.jpg",
        "..%2fx.jpg",
        "%2fetc%2fx.jpg",
        "a%00.jpg",
        "a%0a.jpg",
        ".a.jpg",
        "a.exe",
        "a.html",
        "a.svg",
        "",
        "a%5cb.jpg",
        "%3Cscript%3E.jpg",
        "-o.jpg",
        "*.jpg",
    ] {
        let answer = server.with_body("PUT", &format!("/api/photographs?name={name}"), NO_PHOTOGRAPH);
        assert_eq!(answer.status, 422, "{name}: {answer:?}");
    }
    assert_eq!(server.with_body("PUT", "/api/photographs?name=a.jpg", NO_PHOTOGRAPH).status, 409, "it is there");
    assert_eq!(server.with_body("PUT", "/api/photographs?name=new.jpg", NO_PHOTOGRAPH).status, 201);
    assert_eq!(server.get("/api/photographs/1/thumbnail").status, 422, "it is no photograph");
    place.expect_untouched();
}

/// Of two of one name that come at the same time, the one that is there first stays.
#[test]
fn uploads_of_one_name_are_one_photograph() {
    let place = Place::new();
    let server = place.server();
    let length = format!("Origin: http://{}\r\nContent-Length: {}\r\n", server.host, NO_PHOTOGRAPH.len());
    let mut slow = server.connect();
    slow.write_all(server.head("PUT", "/api/photographs?name=new.jpg", &length).as_bytes()).expect("sent");
    slow.write_all(&NO_PHOTOGRAPH[..4]).expect("sent");
    // The server is to have begun with it.
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(server.with_body("PUT", "/api/photographs?name=new.jpg", NO_PHOTOGRAPH).status, 201);
    drop(slow.write_all(&NO_PHOTOGRAPH[4..]));
    assert_eq!(answer(&mut slow).status, 409);
    assert_eq!(server.get("/api/news").json()["photographs"].as_array().map(Vec::len), Some(2));
}

/// Ten gigabytes are refused before they come, and so is what does not say how long it is.
#[test]
fn uploads_have_limits() {
    let place = Place::new();
    let server = place.server();
    let origin = format!("Origin: http://{}\r\n", server.host);
    let huge =
        server.head("PUT", "/api/photographs?name=huge.jpg", &format!("{origin}Content-Length: 10000000000\r\n"));
    assert_eq!(server.send(&huge).status, 413);
    let endless =
        server.head("PUT", "/api/photographs?name=endless.jpg", &format!("{origin}Transfer-Encoding: chunked\r\n"));
    assert_eq!(server.send(&format!("{endless}5\r\nabcde\r\n")).status, 413);
    let wishes = format!("{{\"options\":{{\"a\":\"{}\"}}}}", "x".repeat(1 << 20));
    let mask = vec![0; (32 << 20) + 1];
    for answer in [server.post("/api/wishes", &wishes), server.with_body("PUT", "/api/photographs/0/mask/use", &mask)] {
        // Who sends on may find the connection closed before the answer is read.
        assert!(matches!(answer.status, 413 | 0), "{answer:?}");
    }
    assert_eq!(server.get("/api/news").json()["can_undo"], false, "nothing was wished for");
    assert_eq!(server.with_body("PUT", "/api/photographs/0/mask/use", b"GIF89a").status, 422);
    assert_eq!(server.get("/api/news").json()["photographs"].as_array().expect("photographs").len(), 1);
    place.expect_untouched();
}

/// Who sends a byte now and then holds nothing for long, be it the head or the body.
#[test]
fn slow_requests_are_given_up() {
    let place = Place::new();
    let server = place.server();
    let origin = format!("Origin: http://{}\r\n", server.host);
    let mut body = server.connect();
    let head = server.head("PUT", "/api/photographs?name=slow.jpg", &format!("{origin}Content-Length: 1000\r\n"));
    body.write_all(format!("{head}abc").as_bytes()).expect("sent");
    let mut unfinished = server.connect();
    unfinished.write_all(b"GET / HTTP/1.1\r\nHost: ").expect("sent");
    assert_eq!(answer(&mut body).status, 408);
    let mut rest = Vec::new();
    unfinished.read_to_end(&mut rest).expect("closed");
    assert!(!String::from_utf8_lossy(&rest).contains("200 OK"), "{rest:?}");
    assert_eq!(server.get("/api/news").json()["photographs"].as_array().expect("photographs").len(), 1);
}

/// How long the server keeps idle connections.
const IDLE_TIME: Duration = Duration::from_secs(10);

/// More connections than a browser ever has are closed; when they end, there is room again.
#[test]
fn connections_have_a_limit() {
    let place = Place::new();
    let server = place.server();
    loop {
        let started = Instant::now();
        let mut held: Vec<_> = (0..64).map(|_| server.connect()).collect();
        for one in &mut held[40..] {
            assert!(matches!(one.read(&mut [0]), Ok(0) | Err(_)), "it was closed");
        }
        // Not because it had nothing to say: the first has had nothing to say for longer.
        held[0].set_read_timeout(Some(Duration::from_millis(10))).expect("a socket");
        let first = held[0].read(&mut [0]);
        // A machine that stood still for as long as idle connections are kept shows nothing.
        if started.elapsed() < IDLE_TIME {
            let open = first.expect_err("there is nothing to read");
            assert!(matches!(open.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{open}");
            break;
        }
    }
    while server.get("/api/news").status != 200 {}
}

/// Nothing that the page does not offer can be set, and nothing that cannot be.
#[test]
fn options_of_the_machine_cannot_be_reached() {
    let place = Place::new();
    let server = place.server();
    let scratch = place.desk.path().join("elsewhere").display().to_string();
    for (name, value) in [
        ("resources.scratch", scratch.as_str()),
        ("resources.memory", "1000GB"),
        ("mesh.cell_px", "1"),
        ("projection.yaw", "1e9"),
        ("projection.yaw", "NaN"),
        ("projection.kind", "$(touch x)"),
        ("output.background", "; touch x"),
        ("canvas.scale", "1e300"),
    ] {
        let body = serde_json::json!({ "options": { name: value } }).to_string();
        for path in ["/api/wishes", "/api/preview"] {
            assert_eq!(server.post(path, &body).status, 422, "{path} {name}={value}");
        }
    }
    for body in ["", "{", "{\"options\":3}", "{\"photographs\":[\"/etc/passwd\"]}", "null"] {
        assert_eq!(server.post("/api/wishes", body).status, 422, "{body}");
    }
    assert_eq!(server.post("/api/wishes", r#"{"left_out":{"99":true}}"#).status, 204);
    assert_eq!(server.get("/api/news").json()["can_undo"], false, "there is no such photograph");
}

/// Files are written under plain names, beside the photographs or on the desk, and never over anything.
#[test]
fn exports_have_plain_names() {
    let place = Place::new();
    let server = place.server();
    for name in ["../x.jpg", "/tmp/x.jpg", "inside/x.jpg", ".x.jpg", "x", "", "a\u{0}.jpg", "-o.jpg"] {
        let body = serde_json::json!({ "name": name, "into_folder": true }).to_string();
        assert_eq!(server.post("/api/exports", &body).status, 422, "{name}");
    }
    assert_eq!(server.post("/api/exports", r#"{"name":"x.jpg","beside":["output"]}"#).status, 404);
    place.expect_untouched();
}

/// Another address than this machine's own takes a password; the address gives nothing away, and guesses wait.
#[test]
fn a_password_is_asked_for() {
    let place = Place::new();
    let server = Server::closed(Some(place.open()), Some("correct horse battery"));
    assert!(!server.url.contains("token"), "{}", server.url);
    let asked = server.send(&format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", server.host));
    assert!(asked.status == 403 && asked.text().contains("type=\"password\""), "{asked:?}");
    assert!(!asked.text().contains("role=\"alert\""), "nothing was wrong yet: {asked:?}");
    let login = |text: &str, origin: &str| {
        let length = text.len();
        server.send(&format!(
            "POST /login HTTP/1.1\r\nHost: {}\r\nOrigin: {origin}\r\nContent-Length: {length}\r\n\r\n{text}",
            server.host
        ))
    };
    let own = format!("http://{}", server.host);
    for wrong in ["password=", "password=wrong", "", "password=correct+horse+battery+", "other=correct+horse+battery"] {
        let answer = login(wrong, &own);
        assert!(answer.status == 403 && !answer.head.contains("set-cookie"), "{wrong}: {answer:?}");
        assert!(answer.head.contains("content-type: text/html; charset=utf-8"), "{wrong}: {answer:?}");
        let said = "<p role=\"alert\">That is not the password.</p></form>";
        assert!(answer.text().contains(said) && answer.text().contains("type=\"password\""), "{wrong}: {answer:?}");
    }
    assert_eq!(login("password=correct+horse+battery", EVIL).status, 403);
    let let_in = login("password=correct+horse%20battery", &own);
    assert!(let_in.status == 303 && let_in.head.contains("set-cookie: "), "{let_in:?}");
}

/// Guesses that never end hold up nobody who knows the password.
#[test]
fn unfinished_guesses_hold_up_nobody() {
    let place = Place::new();
    let server = Server::closed(Some(place.open()), Some("correct horse battery"));
    let head = format!("POST /login HTTP/1.1\r\nHost: {0}\r\nOrigin: http://{0}\r\n", server.host);
    let let_in_at_once = || {
        let mut unfinished = [(); 3].map(|()| {
            let mut guess = server.connect();
            guess.write_all(format!("{head}Content-Length: 99\r\n\r\npassword=").as_bytes()).expect("sent");
            guess
        });
        // The server is to have begun with them.
        std::thread::sleep(Duration::from_millis(200));
        let right = "password=correct+horse+battery";
        let answer = server.send(&format!("{head}Content-Length: {}\r\n\r\n{right}", right.len()));
        assert_eq!(answer.status, 303, "{answer:?}");
        unfinished.iter_mut().all(|guess| {
            guess.set_read_timeout(Some(Duration::from_millis(10))).expect("a socket");
            guess.read(&mut [0]).is_err_and(|open| matches!(open.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut))
        })
    };
    // A machine that stood still until they were given up shows nothing.
    assert!((0..3).any(|_| let_in_at_once()), "guesses were given up before the right one was looked at");
}

#[test]
fn short_passwords_and_missing_folders_are_refused() {
    let network =
        trueup_server::Network { address: "127.0.0.1".parse().expect("an address"), password: "short".to_owned() };
    let serving = trueup_server::Serving { folder: None, port: 0, network: Some(network) };
    let cancel = trueup::CancelToken::default();
    let refused = trueup_server::serve(&serving, &cancel, |_| panic!("nobody listens")).expect_err("too short");
    assert!(refused.to_string().contains("shorter than 12"), "{refused}");
    assert!(!format!("{serving:?}").contains("short\""), "passwords are not told");
    let serving = trueup_server::Serving { folder: Some("none/such".into()), port: 0, network: None };
    let refused = trueup_server::serve(&serving, &cancel, |_| panic!("nobody listens")).expect_err("no folder");
    assert!(refused.to_string().contains("none/such"), "{refused}");
}
