#include "base/program_identity.h"

#include <elf.h>
#include <link.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace crt {
namespace {

constexpr std::size_t padded(std::size_t size) { return (size + 3) / 4 * 4; }

/// The build ID among the notes of a segment; empty if it has none.
std::string idAmong(const char* notes, std::size_t size) {
    while (size >= sizeof(ElfW(Nhdr))) {
        ElfW(Nhdr) head;
        std::memcpy(&head, notes, sizeof head);
        const std::size_t name = sizeof head, value = name + padded(head.n_namesz),
                          end = value + padded(head.n_descsz);
        if (end > size) break;
        if (head.n_type == NT_GNU_BUILD_ID && head.n_namesz == sizeof ELF_NOTE_GNU &&
            std::memcmp(notes + name, ELF_NOTE_GNU, sizeof ELF_NOTE_GNU) == 0)
            return {notes + value, head.n_descsz};
        notes += end;
        size -= end;
    }
    return {};
}

struct Search {
    std::uintptr_t code;  ///< An address in the file.
    std::string id;
};

/// Called for each file that is loaded; ends the search at the one that holds the code.
int look(dl_phdr_info* file, std::size_t, void* data) {
    auto& search = *static_cast<Search*>(data);
    bool holds = false;
    std::string id;
    for (unsigned i = 0; i < file->dlpi_phnum; ++i) {
        const ElfW(Phdr)& segment = file->dlpi_phdr[i];
        const std::uintptr_t start = file->dlpi_addr + segment.p_vaddr;
        if (segment.p_type == PT_LOAD)
            holds = holds || (search.code >= start && search.code - start < segment.p_memsz);
        if (segment.p_type == PT_NOTE && id.empty())
            id = idAmong(reinterpret_cast<const char*>(start), segment.p_memsz);
    }
    if (!holds) return 0;
    search.id = id;
    return 1;
}

}  // namespace

std::string buildId() {
    static const std::string id = [] {
        Search search{reinterpret_cast<std::uintptr_t>(&buildId), {}};
        ::dl_iterate_phdr(look, &search);
        return search.id;
    }();
    return id;
}

}  // namespace crt
