// A plugin with one defect, chosen by CRT_FAKE_DEFECT. Written against the C interface alone, because
// plugin_guard.h would not let most of these happen.
#include "backend/crt_backend.h"
#include "backend/crt_layout_hash.h"
#include "kernel/dialect/bits_version.h"

#include <cstddef>
#include <cstdio>
#include <stdexcept>

namespace {

enum Defect {
    no_table,
    small_table,
    wrong_abi,
    wrong_layout,
    wrong_bits,
    no_bits,
    short_reach,
    version_1_1,
    no_create,
    no_device,
    many_devices,
    throws_in_entry,
    throws_in_probe,
    throws_in_create,
    throws_in_render,
};
constexpr Defect kDefect = CRT_FAKE_DEFECT;

void say(char* reason, uint32_t size, const char* text) { std::snprintf(reason, size, "%s", text); }

CrtStatus probe(const CrtHost*, CrtDevice* devices, uint32_t capacity, uint32_t* count, char* reason,
                uint32_t reason_size) {
    if (kDefect == throws_in_probe) throw std::runtime_error("probe fell over");
    if (kDefect == no_device) {
        *count = 0;
        say(reason, reason_size, "the driver is older than 1.2");
        return CRT_NO_DEVICE;
    }
    // More than the host makes room for at first.
    *count = kDefect == many_devices ? 40 : 1;
    for (uint32_t i = 0; i < *count && i < capacity; ++i) {
        devices[i].index = i;
        devices[i].score = i;
        std::snprintf(devices[i].name, sizeof(devices[i].name), "device %u", i);
    }
    return CRT_OK;
}

CrtStatus setScene(CrtIntegratorState*, const CrtSceneBlob*) { return CRT_OK; }
CrtStatus render(CrtIntegratorState*, const CrtRenderRange*) {
    if (kDefect == throws_in_render) throw 42;
    return CRT_INTERNAL;
}
CrtStatus readFilm(CrtIntegratorState*, const CrtFilmView*) { return CRT_INTERNAL; }
CrtStatus getReport(CrtIntegratorState*, CrtBackendReport*) { return CRT_INTERNAL; }
const char* lastError(CrtIntegratorState*) { return nullptr; }
void destroy(CrtIntegratorState*) {}

CrtStatus create(const CrtHost*, const CrtCreateInfo*, CrtIntegrator* integrator, char*, uint32_t) {
    if (kDefect == throws_in_create) throw std::runtime_error("create fell over");
    *integrator = {
        sizeof(CrtIntegrator), 0, nullptr, setScene, render, readFilm, getReport, lastError, destroy};
    return CRT_OK;
}

const CrtBackend kTable = {
    kDefect == small_table ? 32
    : kDefect == no_bits   ? offsetof(CrtBackend, bits_version)
    : kDefect == version_1_1 ? offsetof(CrtBackend, brings)
                           : sizeof(CrtBackend),
    kDefect == wrong_abi ? CRT_ABI_MAJOR + 1 : CRT_ABI_MAJOR,
    CRT_ABI_MINOR,
    kDefect == wrong_layout ? ~CRT_LAYOUT_HASH : CRT_LAYOUT_HASH,
    CRT_FAKE_NAME,
    "0.0.1",
    "an old compiler",
    ~uint64_t{0},
    probe,
    kDefect == no_create ? nullptr : create,
    kDefect == wrong_bits ? CRT_BITS_VERSION + 1 : CRT_BITS_VERSION,
    0,
    CRT_BRINGS_ACCELERATOR,
    kDefect == short_reach ? 0.5 : 2,
};

}  // namespace

const CrtBackend* crt_backend_v1(void) {
    if (kDefect == throws_in_entry) throw std::runtime_error("the entry fell over");
    return kDefect == no_table ? nullptr : &kTable;
}
