//! An ELF of the microcontroller: its functions, and the bytes of its sections.

use std::path::Path;

use object::read::elf::ElfFile32;
use object::{LittleEndian, Object as _, ObjectSection as _, ObjectSymbol as _, SectionFlags, SymbolKind};

use crate::board::BoardError;
use crate::report::files;

/// A function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name, demangled.
    pub name: String,
    /// Its first address.
    pub address: u32,
    /// Its bytes, constants between them included.
    pub bytes: Vec<u8>,
}

/// A linked program.
#[derive(Clone, Debug)]
pub struct ElfImage {
    /// The functions in the order of their addresses, each address once.
    pub functions: Vec<Function>,
    /// Addresses at which constants begin (`false`) or code begins (`true`), in their order.
    pub code_from: Vec<(u32, bool)>,
    /// Code, constants and initial values of variables.
    pub flash_bytes: u64,
    /// Variables.
    pub static_bytes: u64,
}

impl ElfImage {
    /// Reads the ELF at `path`.
    ///
    /// # Errors
    /// When it cannot be read or is no ELF of a 32-bit machine.
    pub fn read(path: &Path) -> Result<Self, BoardError> {
        Self::parse(&files::read(path)?)
            .map_err(|error| BoardError::NoElf { path: path.to_owned(), error: error.to_string() })
    }

    fn parse(bytes: &[u8]) -> Result<Self, object::Error> {
        let file = ElfFile32::<LittleEndian>::parse(bytes)?;
        let (mut flash_bytes, mut static_bytes) = (0, 0);
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 {
                continue;
            }
            let stored = section.file_range().is_some();
            let writable = sh_flags & u64::from(object::elf::SHF_WRITE) != 0;
            flash_bytes += if stored { section.size() } else { 0 };
            static_bytes += if writable { section.size() } else { 0 };
        }
        let mut functions = Vec::new();
        let mut code_from = Vec::new();
        for symbol in file.symbols() {
            let name = symbol.name()?;
            #[expect(clippy::cast_possible_truncation, reason = "a 32-bit machine")]
            let address = symbol.address() as u32;
            if name == "$t" || name.starts_with("$t.") {
                code_from.push((address, true));
            } else if name == "$d" || name.starts_with("$d.") {
                code_from.push((address, false));
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                let Some(index) = symbol.section_index() else { continue };
                let section = file.section_by_index(index)?;
                // The lowest bit of a function's address marks Thumb code.
                let address = address & !1;
                let data = section.data_range(address.into(), symbol.size())?.unwrap_or_default();
                let name = format!("{:#}", rustc_demangle::demangle(name));
                functions.push(Function { name, address, bytes: data.to_vec() });
            }
        }
        functions.sort_by_key(|function| function.address);
        functions.dedup_by_key(|function| function.address);
        code_from.sort_unstable();
        Ok(Self { functions, code_from, flash_bytes, static_bytes })
    }

    /// An image of functions alone.
    #[cfg(test)]
    pub(crate) fn of(functions: Vec<Function>, code_from: Vec<(u32, bool)>) -> Self {
        Self { functions, code_from, flash_bytes: 0, static_bytes: 0 }
    }
}
