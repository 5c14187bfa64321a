//! A page to stitch in, for one person on their own machine: what `trueup serve` runs.
//!
//! The page shows the photographs of a folder with what became of each, the panorama, large, and the choices that the
//! options declare; it asks this server, and this server asks the library. No algorithm and no default lives in either.
//!
//! **Nobody else gets in.** The server listens on this machine alone, unless a password is given. Every request passes
//! the guard: it must name the server as the browser was told to, come from the page itself, and hold the session that
//! only the address printed in the terminal, or the password, opens. Requests name no paths; what is read lies in the
//! folder opened or was dropped on the page; and all that is sent has a limit.
#![forbid(unsafe_code)]

mod body;
mod denial;
mod folder;
#[doc(hidden)]
pub mod fuzzing;
mod guard;
mod keeping;
mod layers;
mod limits;
mod making;
mod pages;
mod reopening;
mod routes;
mod studio;
mod told;
mod work;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use trueup::{CancelToken, Error, Result};

use folder::Folder;
use guard::Guard;
use limits::{HEAD_TIME, MAX_CONNECTIONS, MIN_PASSWORD};
use studio::Studio;

/// How often it is looked whether the server is to stop: nobody notices so short a wait.
const STOP_EVERY: Duration = Duration::from_millis(100);

/// How long work that was asked to stop is waited for: people press Ctrl-C again after a second.
const STOP_WITHIN: Duration = Duration::from_millis(500);

/// What to serve, and to whom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Serving {
    /// The folder whose photographs are shown; without one, photographs are dropped on the page.
    pub folder: Option<PathBuf>,
    /// The port; 0 for any that is free.
    pub port: u16,
    /// An address to listen at in place of this machine's own, and the password that it takes.
    pub network: Option<Network>,
}

/// Another address than this machine's own.
#[derive(Clone, PartialEq, Eq)]
pub struct Network {
    /// The address.
    pub address: IpAddr,
    /// Who knows it is let in. At least twelve characters.
    pub password: String,
}

impl std::fmt::Debug for Network {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Network").field("address", &self.address).finish_non_exhaustive()
    }
}

impl Serving {
    fn address(&self) -> SocketAddr {
        let own = IpAddr::V4(Ipv4Addr::LOCALHOST);
        SocketAddr::new(self.network.as_ref().map_or(own, |network| network.address), self.port)
    }

    fn studio(&self) -> Result<Studio> {
        let open = |path: &PathBuf| Folder::open(path).map_err(|error| Error::io("opening the folder", path, error));
        Studio::new(self.folder.as_ref().map(open).transpose()?)
    }

    fn check_password(&self) -> Result<()> {
        match &self.network {
            Some(network) if network.password.chars().count() < MIN_PASSWORD => Err(Error::input(
                "password",
                format!("it is shorter than {MIN_PASSWORD} characters"),
                "Take a longer one: everybody in the network can try.",
            )),
            _ => Ok(()),
        }
    }
}

/// Serves the page until `cancel` is cancelled. `told` is called once, with the address to open, when the server
/// listens. Temporary files are gone when it returns.
///
/// # Errors
/// [`Error::Input`] for a short password; [`Error::Io`] if the folder cannot be opened, or nobody can listen there.
pub fn serve(serving: &Serving, cancel: &CancelToken, told: impl FnOnce(&str)) -> Result<()> {
    serving.check_password()?;
    let studio = Arc::new(serving.studio()?);
    let failed = |error| Error::io("listening at", Path::new(&serving.address().to_string()), error);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(failed)?;
    let served = runtime.block_on(async {
        let listener = TcpListener::bind(serving.address()).await?;
        let password = serving.network.as_ref().map(|network| network.password.as_str());
        let guard = Arc::new(Guard::new(listener.local_addr()?, password)?);
        told(&guard.url());
        let checked = axum::middleware::from_fn_with_state(guard, guard::check);
        accept(&listener, routes::router(studio.clone()).layer(checked), cancel).await;
        Ok(())
    });
    work::stop(&studio, None);
    // Work that does not stop soon is not waited for.
    let patience = Instant::now() + STOP_WITHIN;
    while studio.state().work.is_some() && Instant::now() < patience {
        std::thread::sleep(STOP_EVERY);
    }
    runtime.shutdown_background();
    // Whoever still holds the studio holds it for good. What cannot be removed is left to the system.
    drop(std::fs::remove_dir_all(studio.desk.path()));
    served.map_err(failed)
}

/// Takes connections until it is to stop; those beyond [`MAX_CONNECTIONS`] are closed.
async fn accept(listener: &TcpListener, router: Router, cancel: &CancelToken) {
    let permits = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    while !cancel.is_cancelled() {
        let Ok(accepted) = tokio::time::timeout(STOP_EVERY, listener.accept()).await else { continue };
        match (accepted, permits.clone().try_acquire_owned()) {
            (Ok((stream, _)), Ok(permit)) => {
                let router = router.clone();
                tokio::spawn(async move {
                    answer(stream, router).await;
                    drop(permit);
                });
            }
            (Ok(_), Err(_)) => {}
            // Too many files are open: connections that end make room.
            (Err(_), _) => tokio::time::sleep(STOP_EVERY).await,
        }
    }
}

/// Answers what comes over a connection.
pub(crate) async fn answer(stream: impl AsyncRead + AsyncWrite + Unpin + 'static, router: Router) {
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME);
    let served = server.serve_connection(TokioIo::new(stream), TowerToHyperService::new(router));
    // Whoever went away, or spoke no HTTP, is told nothing.
    drop(served.await);
}
