//! The description of the bench over a loss of power: kept, restored and forgotten, by a store outside of the tick.
//!
//! A request of the host waits until the program calls [`Application::use_store`], between two ticks, which takes long:
//! the flash may hold the processor. It happens only while the drive is off.

use embedded_storage_async::nor_flash::NorFlash;
use link::{
    BoardFault, BoardMessage, DescriptionDigest, DescriptionDigests, HostMessage, MapFault, decode_part,
    description_messages,
};

use super::configured_move::Bench;
use super::{Application, WELCOME};
use crate::design::DesignedDrive;
use crate::store::{NotStored, Store};

/// What is to be done by the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StoreRequest {
    /// A session begins.
    Restore,
    Keep,
    Forget,
    Digest,
}

impl<D: DesignedDrive> Application<'_, D> {
    /// The kept description is in force, or the default one where none is kept; from now on the program uses the store
    /// when it is asked to ([`Self::wants_store`]).
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub fn restore<F: NorFlash>(&mut self, store: &mut Store<F>) {
        self.has_store = true;
        self.forget_description();
        let mut is_taken = true;
        store.read(|part| {
            let answer = decode_part(part).and_then(|message| self.describe_by(&message));
            is_taken &= answer == Some(BoardMessage::Described);
        });
        if !is_taken || self.described_by().is_err() {
            self.forget_description();
        }
    }

    /// Whether the host waits for something that the store does.
    pub fn wants_store(&self) -> bool {
        self.store_request.is_some()
    }

    /// Does what the host has asked of the store, and gives the frame of the answer to `send`.
    // Never inlined: as above.
    #[inline(never)]
    pub fn use_store<F: NorFlash>(&mut self, store: &mut Store<F>, send: &mut impl FnMut(&[u8])) {
        let Some(request) = self.store_request.take() else { return };
        let answer = if self.is_driving() {
            self.refused_while_driving()
        } else {
            self.done(request, store).unwrap_or_else(BoardMessage::Fault)
        };
        self.send(&answer, send);
    }

    /// Puts a request off until the program uses the store. While the drive may be on, and without a store, it is
    /// refused.
    pub(super) fn ask_store(&mut self, request: StoreRequest) -> Option<BoardMessage> {
        if self.is_driving() {
            return Some(self.refused_while_driving());
        }
        if !self.has_store {
            return Some(BoardMessage::Fault(BoardFault::KeepsNothing));
        }
        self.store_request = Some(request);
        None
    }

    /// From now on the default description is in force, and nothing is configured.
    pub(super) fn forget_description(&mut self) {
        self.memory.configured = None;
        self.memory.map.forget();
        self.bench = Bench::default();
    }

    fn done<F: NorFlash>(
        &mut self,
        request: StoreRequest,
        store: &mut Store<F>,
    ) -> Result<BoardMessage, BoardFault> {
        match request {
            StoreRequest::Restore => {
                self.restore(store);
                Ok(WELCOME)
            }
            StoreRequest::Keep => {
                store.keep(self.described_by().map_err(BoardFault::Map)?)?;
                Ok(BoardMessage::Kept)
            }
            StoreRequest::Forget => {
                self.forget_description();
                store.forget()?;
                Ok(BoardMessage::Forgotten)
            }
            StoreRequest::Digest => {
                let in_force = DescriptionDigest::of(self.described_by().map_err(BoardFault::Map)?)
                    .map_err(|_| BoardFault::NotStored)?;
                Ok(BoardMessage::Digests(DescriptionDigests { in_force, kept: store.kept() }))
            }
        }
    }

    /// The messages that describe what is in force. A map that no configuration would plan by has none.
    fn described_by(&self) -> Result<impl Iterator<Item = HostMessage>, MapFault> {
        let Bench { design, instruments, timing } = &self.bench;
        let map = self.memory.map.received();
        if map.is_some() {
            self.bench.check_map(&self.memory.map)?;
        }
        Ok(description_messages(design, *instruments, *timing, map))
    }
}

impl From<NotStored> for BoardFault {
    fn from(NotStored: NotStored) -> Self {
        Self::NotStored
    }
}
