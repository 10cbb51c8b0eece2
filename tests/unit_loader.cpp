// The border from the host's side: every way in which a plugin can be wrong has its own sentence, and none
// of them brings crt down.
#include "backend/crt_layout_hash.h"
#include "backend/kernel_source.h"
#include "backend/loader.h"
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "kernel/dialect/bits_version.h"
#include "scoped_variable.h"

#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>

using namespace crt;
using crt::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

/// The sentence with which loading (and probing) a backend is refused; empty when it is not.
std::string refusal(const std::string& name) {
    const ScopedVariable path("CRT_BACKEND_PATH", CRT_FAKE_PLUGIN_DIR);
    try {
        probeDevices(loadBackend(name));
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Backend);
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("a plugin that is not there", "[loader]") {
    CHECK_THAT(
        refusal("exampel"),
        Contains("backend 'exampel' is unknown: no crt_backend_exampel.so in " CRT_FAKE_PLUGIN_DIR ", ") &&
            Contains("did you mean 'example'?"));
    CHECK_THAT(refusal("/nowhere/crt_backend_x.so"),
               Contains("there is no backend file /nowhere/crt_backend_x.so"));
    CHECK_THAT(refusal(""), Contains("the backend has no name"));

    // A name that crt knows is not a spelling mistake. Those that were built next to this program are always
    // found.
    const TemporaryFolder empty;
    const ScopedVariable path("CRT_BACKEND_PATH", empty.path());
    for (const std::string name : {"cuda", "embree", "opencl"}) {
        if (fs::exists(CRT_BACKEND_DIR "/crt_backend_" + name + ".so")) continue;
        CHECK_THROWS_WITH(loadBackend(name),
                          Contains("backend '" + name + "' is not installed: no crt_backend_" + name +
                                   ".so in " + empty.path()) &&
                              !Contains("did you mean"));
    }
}

TEST_CASE("a plugin that cannot be opened", "[loader]") {
    CHECK_THAT(
        refusal("missing_library"),
        Contains("cannot be opened") && Contains("libcrt_absent.so.1: cannot open shared object file"));

    const TemporaryFolder directory;
    directory.write("crt_backend_text.so", "this is not a library\n");
    fs::create_symlink("/nowhere", directory / "crt_backend_dangling.so");
    const ScopedVariable path("CRT_BACKEND_PATH", directory.path());
    CHECK_THROWS_WITH(loadBackend("text"), Contains("cannot be opened") && Contains("file too short"));
    CHECK_THROWS_WITH(loadBackend("dangling"), Contains("cannot be opened"));
}

TEST_CASE("a library that is no plugin of this version", "[loader]") {
    CHECK_THAT(refusal("no_symbol"), Contains("is not a crt backend, or built for another major version") &&
                                         Contains("undefined symbol: crt_backend_v1"));
    CHECK_THAT(
        refusal("wrong_abi"),
        Contains("has version 2.3 of the plugin interface and this crt has 1.3: rebuild the plugin"));
    CHECK_THAT(refusal("no_table"), Contains("crt_backend_v1 returned no table"));
    CHECK_THAT(refusal("small_table"), Contains("its table has 32 bytes where version 1 needs " +
                                                std::to_string(offsetof(CrtBackend, bits_version))));
    CHECK_THAT(refusal("no_create"), Contains("its table lacks create"));
}

TEST_CASE("a plugin built for another scene layout names both builds", "[loader]") {
    const auto hex = [](std::uint64_t hash) {
        char text[17];
        std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash));
        return std::string(text);
    };
    CHECK_THAT(
        refusal("wrong_layout"),
        Contains("was built for another scene layout, " + hex(~CRT_LAYOUT_HASH) + " (an old compiler)") &&
            Contains(hex(CRT_LAYOUT_HASH) + " (crt " CRT_HEADERS_VERSION ", ") &&
            Contains("rebuild the plugin"));
}

TEST_CASE("a plugin that renders other bits is refused by both versions and both builds", "[loader]") {
    const auto check = [](const std::string& plugin, std::uint32_t version) {
        CHECK_THAT(refusal(plugin),
                   Contains("renders bits version " + std::to_string(version) +
                            " (an old compiler), and this crt has bits version " +
                            std::to_string(CRT_BITS_VERSION) + " (crt " CRT_HEADERS_VERSION ", ") &&
                       Contains("rebuild the plugin"));
    };
    check("wrong_bits", CRT_BITS_VERSION + 1);
    check("no_bits", 1);  // its table ends before the version
    CHECK(refusal("fake").empty());
}

TEST_CASE("what a backend brings is read from tables that have it, and must reach the scene", "[loader]") {
    const ScopedVariable path("CRT_BACKEND_PATH", CRT_FAKE_PLUGIN_DIR);
    CHECK_THAT(refusal("short_reach"),
               Contains("its acceleration structure reaches 0.5, and scenes reach 1"));
    CHECK(acceleratorReach(loadBackend("many_devices")) == 2);
    CHECK(acceleratorReach(loadBackend("version_1_1")) == 0);  // its table ends before
    CHECK(acceleratorReach(loadBackend("fake")) == 0);
}

TEST_CASE("no device is an answer with a reason", "[loader]") {
    CHECK(refusal("no_device") == "backend 'no_device' has no usable device: the driver is older than 1.2");
}

TEST_CASE("an exception that crosses the border is named and survived", "[loader]") {
    CHECK(refusal("throws_in_entry") ==
          "backend 'throws_in_entry' broke the contract: an exception crossed the border from "
          "crt_backend_v1 (the entry fell over)");
    CHECK(refusal("throws_in_probe") ==
          "backend 'throws_in_probe' broke the contract: an exception "
          "crossed the border from probe (probe fell over)");
}

TEST_CASE("a good plugin loads by name and by path", "[loader]") {
    const ScopedVariable path("CRT_BACKEND_PATH", ":/nowhere:" CRT_FAKE_PLUGIN_DIR ":");
    const LoadedBackend by_name = loadBackend("fake");
    CHECK(by_name.name == "fake");
    CHECK(by_name.path == CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so");
    CHECK(by_name.table->layout_hash == CRT_LAYOUT_HASH);
    const LoadedBackend by_path = loadBackend(by_name.path);
    CHECK(by_path.name == "fake");
    CHECK(by_path.table == by_name.table);
}

TEST_CASE("devices come best first, however many there are", "[loader]") {
    const ScopedVariable path("CRT_BACKEND_PATH", CRT_FAKE_PLUGIN_DIR);
    const std::vector<CrtDevice> many = probeDevices(loadBackend("many_devices"));
    REQUIRE(many.size() == 40);
    CHECK(std::string(many.front().name) == "device 39");
    CHECK(std::string(many.back().name) == "device 0");

    const std::vector<CrtDevice> two = probeDevices(loadBackend("fake"));
    REQUIRE(two.size() == 2);
    CHECK(std::string(two[0].name) == "pattern");
    CHECK(two[1].index == 1);
}

TEST_CASE("the list of backends has the known ones, the found ones and every reason", "[loader]") {
    const ScopedVariable path("CRT_BACKEND_PATH", CRT_FAKE_PLUGIN_DIR);
    std::map<std::string, BackendStatus> list;
    for (BackendStatus& status : listBackends()) list.emplace(status.name, status);
    for (const char* known : {"cuda", "embree", "opencl"}) CHECK(list.count(known) == 1);
    REQUIRE(list.count("fake") == 1);
    CHECK(list["fake"].reason.empty());
    CHECK(list["fake"].version == CRT_HEADERS_VERSION);
    CHECK(list["fake"].devices.size() == 2);
    CHECK_THAT(list["wrong_abi"].reason, Contains("version 2.3"));
    CHECK_THAT(list["no_device"].reason, Contains("older than 1.2"));
    CHECK(list["no_device"].build == "an old compiler");
}

TEST_CASE("the kernel cache directory", "[loader]") {
    const TemporaryFolder base;
    const ScopedVariable crt_dir("CRT_CACHE_DIR", std::nullopt);
    const ScopedVariable xdg("XDG_CACHE_HOME", base / "xdg");
    const ScopedVariable home("HOME", base / "home");

    CHECK(makeHost(false).cache_directory == nullptr);
    REQUIRE(makeHost(true).cache_directory != nullptr);
    CHECK(makeHost(true).cache_directory == base / "xdg/crt");
    // Cached kernels are executed: no other user may write there.
    CHECK((fs::status(base / "xdg/crt").permissions() & fs::perms::all) == fs::perms::owner_all);
    {
        const ScopedVariable relative("XDG_CACHE_HOME", "relative");
        CHECK(makeHost(true).cache_directory == base / "home/.cache/crt");
    }
    {
        const ScopedVariable own("CRT_CACHE_DIR", base / "own/deep");
        CHECK(makeHost(true).cache_directory == base / "own/deep");
    }
    {
        base.write("file", "in the way");
        const ScopedVariable unusable("CRT_CACHE_DIR", base / "file");
        CHECK(makeHost(true).cache_directory == nullptr);
        const ScopedVariable below("CRT_CACHE_DIR", base / "file/below");
        CHECK(makeHost(true).cache_directory == nullptr);
    }
}

TEST_CASE("the host's functions throw nothing at a plugin", "[loader]") {
    const CrtHost host = makeHost(false);
    host.log(host.user, CRT_LOG_DEBUG, nullptr);
    host.log(host.user, 99, "a level of the future");
    CHECK(host.progress(host.user, 0.5) == 0);
    CHECK(host.kernel_source(host.user, nullptr) == nullptr);
    CHECK(host.kernel_source(host.user, "kernel/no_such_kernel.h") == nullptr);
    CHECK(host.kernel_source(host.user, "base/error.h") == nullptr);
    CHECK(host.kernel_source(host.user, "kernel/../base/error.h") == nullptr);
}

TEST_CASE("kernel sources come with their includes, once each", "[loader]") {
    const ScopedVariable embedded("CRT_KERNEL_DIR", std::nullopt);
    const CrtHost host = makeHost(false);
    const char* text = host.kernel_source(host.user, "kernel/dialect/layout.h");
    REQUIRE(text != nullptr);
    CHECK(text == host.kernel_source(host.user, "kernel/dialect/layout.h"));
    const std::string source = text;
    CHECK_THAT(source, Contains("typedef struct CrtScene") && Contains("#define CRT_DIALECT_H"));
    CHECK_THAT(source, !Contains("#include \""));
    CHECK(source.find("#define CRT_DIALECT_H") == source.rfind("#define CRT_DIALECT_H"));
}

TEST_CASE("the whole kernel is one text", "[loader]") {
    const ScopedVariable embedded("CRT_KERNEL_DIR", std::nullopt);
    const char* text = kernelSource("kernel/schedule/pixel.h");
    REQUIRE(text != nullptr);
    const std::string source = text;
    CHECK_THAT(source, !Contains("#include \""));
    for (const char* guard : {"CRT_DIALECT_H", "CRT_FEATURES_H", "CRT_LAYOUT_H", "CRT_PIXEL_H"}) {
        const std::string define = std::string("#define ") + guard + "\n";
        INFO(guard);
        CHECK(source.find(define) != std::string::npos);
        CHECK(source.find(define) == source.rfind(define));
    }
}

TEST_CASE("expanding includes", "[loader]") {
    std::map<std::string, std::string> files{
        {"once.h", "#ifndef ONCE_H\n#define ONCE_H\nint once;\n#endif\n"},
        {"both.h", "#ifndef BOTH_H\n#include \"once.h\"\n  #  include\t\"once.h\" // again\n#endif\n"},
        {"circle.h", "#ifndef C_H\n#include \"circle.h\"\nint circle;\n#endif"},
        {"maybe.h",
         "#ifndef M_H\n#ifdef FAST\n#include \"once.h\"\n#else\n#include \"once.h\"\n#endif\n#endif\n"},
        {"angle.h", "#include <cstdint>\n/*\n * #include \"once.h\" is how to use it\n */\n"},
        {"broken.h", "#include \"absent.h\"\n"},
    };
    const auto text_of = [&](const std::string& name) -> std::optional<std::string> {
        const auto found = files.find(name);
        if (found == files.end()) return std::nullopt;
        return found->second;
    };
    const auto count = [](const std::string& text, const std::string& part) {
        int n = 0;
        for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
        return n;
    };
    CHECK(count(expandIncludes("both.h", text_of), "int once;") == 1);
    CHECK(count(expandIncludes("circle.h", text_of), "int circle;") == 1);
    // Only the compiler knows which of the two is compiled.
    CHECK(count(expandIncludes("maybe.h", text_of), "int once;") == 2);
    CHECK_THAT(expandIncludes("angle.h", text_of),
               Contains("#include <cstdint>\n") && Contains(" * #include \"once.h\" is how"));
    CHECK_THROWS_WITH(expandIncludes("broken.h", text_of),
                      Contains("kernel header broken.h includes absent.h, which does not exist"));
}

TEST_CASE("CRT_KERNEL_DIR replaces the embedded sources", "[loader]") {
    const TemporaryFolder directory;
    fs::create_directory(fs::path(directory.path()) / "schedule");
    fs::copy(fs::path(CRT_SOURCE_DIR) / "core/kernel/dialect", fs::path(directory.path()) / "dialect");
    directory.write("schedule/pixel.h", "#include \"kernel/dialect/layout.h\"\nint changed;\n");
    const ScopedVariable kernels("CRT_KERNEL_DIR", directory.path());
    const char* text = kernelSource("kernel/schedule/pixel.h");
    REQUIRE(text != nullptr);
    CHECK_THAT(text, Contains("int changed;") && Contains("typedef struct CrtScene"));
    // All or nothing: what is not there is not taken from the program.
    CHECK(kernelSource("kernel/materials/bsdf.h") == nullptr);

    // A layout of another build would misread the scene. Another directory, because texts once handed out
    // stay.
    const TemporaryFolder other;
    fs::copy(directory.path(), other.path(), fs::copy_options::recursive);
    other.write("dialect/layout.h", "struct Changed;\n");
    const ScopedVariable changed("CRT_KERNEL_DIR", other.path());
    CHECK_THROWS_WITH(kernelSource("kernel/schedule/pixel.h"),
                      Contains("holds a kernel/dialect/layout.h that differs"));
    const CrtHost host = makeHost(false);
    CHECK(host.kernel_source(host.user, "kernel/schedule/pixel.h") == nullptr);
}
