// crt runs no code that other users could have written: kernels of the cache, plugins, programs, and the
// targets of links.
#include "backend/loader.h"
#include "backend/sdk/kernel_cache.h"
#include "base/code_trust.h"
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "refusal.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

using namespace crt;
using crt::TemporaryFolder;
using crt::test::refusal;
namespace fs = std::filesystem;

namespace {

std::string kernelEntry(const plugin::KernelCache& cache, const std::string& name) {
    return cache.path(plugin::KernelCache::makeKey({name}));
}

}  // namespace

TEST_CASE("a kernel that others could have written is not loaded", "[trust]") {
    const TemporaryFolder folder;
    const plugin::KernelCache cache(folder.path().c_str());
    const auto key = plugin::KernelCache::makeKey({"a"});
    const std::string entry = kernelEntry(cache, "a");
    REQUIRE(cache.store(key, "code", 4));
    std::string refused;
    CHECK(cache.load(key, &refused));
    CHECK(refused.empty());

    REQUIRE(::chmod(entry.c_str(), 0666) == 0);
    CHECK_FALSE(cache.load(key, &refused));
    CHECK_THAT(refused,
               Contains("everyone can write to '" + entry + "' (mode 0666)") && Contains("chmod go-w"));
    REQUIRE(::chmod(entry.c_str(), 0600) == 0);
    CHECK(cache.load(key));
    if (::geteuid() == 0) {  // Only root gives files away.
        REQUIRE(::chown(entry.c_str(), 65534, 65534) == 0);
        CHECK_FALSE(cache.load(key, &refused));
        CHECK_THAT(refused, Contains("belongs to another user"));
    }
    fs::remove(entry);
    REQUIRE(::mkfifo(entry.c_str(), 0600) == 0);
    CHECK_FALSE(cache.load(key, &refused));
    CHECK_THAT(refused, Contains("is not a regular file"));
    fs::remove(entry);
    // A link is another's way to choose the file.
    fs::create_symlink("/etc/passwd", entry);
    CHECK_FALSE(cache.load(key));
}

TEST_CASE("a plugin that others could have written is not opened", "[trust]") {
    const TemporaryFolder folder;
    const fs::path plugins = folder / "plugins";
    fs::create_directory(plugins);
    REQUIRE(::chmod(plugins.c_str(), 0755) == 0);
    const std::string plugin = plugins / "crt_backend_fake.so";
    fs::copy_file(CRT_FAKE_PLUGIN_DIR "/crt_backend_fake.so", plugin);
    REQUIRE(::chmod(plugin.c_str(), 0755) == 0);
    CHECK(refusal([&] { loadBackend(plugin); }).empty());

    const auto refusedWith = [&](const std::string& path, mode_t mode) {
        struct stat before {};
        REQUIRE(::stat(path.c_str(), &before) == 0);
        REQUIRE(::chmod(path.c_str(), mode) == 0);
        const std::string sentence = refusal([&] { loadBackend(plugin); });
        REQUIRE(::chmod(path.c_str(), before.st_mode) == 0);
        return sentence;
    };
    CHECK_THAT(refusedWith(plugin, 0777),
               Contains("is refused: everyone can write to '" + plugin + "' (mode 0777)"));
    CHECK_THAT(refusedWith(plugins, 0777),
               Contains("is refused: everyone can write to '" + plugins.string() + "'"));
    CHECK_THAT(refusedWith(folder.path(), 0777),
               Contains("is refused: everyone can write to '" + folder.path() + "'"));  // further up
    CHECK(refusedWith(plugins, 01777).empty());  // sticky, as /tmp: users cannot replace what is another's
    if (::geteuid() == 0) {
        REQUIRE(::chown(plugin.c_str(), 65534, 65534) == 0);
        CHECK_THAT(refusal([&] { loadBackend(plugin); }), Contains("belongs to another user"));
        REQUIRE(::chown(plugin.c_str(), 0, 65534) == 0);
        CHECK_THAT(refusedWith(plugin, 0775), Contains("the group") && Contains("can write to"));
        REQUIRE(::chown(plugin.c_str(), 0, 0) == 0);
        CHECK(refusedWith(plugin, 0775).empty());  // root's own group: a umask of 002
    }
    fs::create_symlink(plugin, folder / "link.so");
    CHECK_THAT(refusal([&] { loadBackend(folder / "link.so"); }), !Contains("refused"));
}

TEST_CASE("a link that others could have made leads to no code", "[trust]") {
    const TemporaryFolder folder;
    const auto makeFolder = [&](const char* name, mode_t mode) {
        const fs::path made = folder / name;
        fs::create_directory(made);
        REQUIRE(::chmod(made.c_str(), mode) == 0);
        return made;
    };
    const fs::path closed = makeFolder("closed", 0755), open = makeFolder("open", 0777);
    const fs::path sticky = makeFolder("sticky", 01777);
    const std::string file = fs::canonical(closed) / "code";
    std::ofstream(file) << "code";
    REQUIRE(::chmod(file.c_str(), 0644) == 0);

    // The path to be opened has no link any more, so that none can be turned.
    fs::create_symlink("code", closed / "name");
    fs::create_symlink("../closed/name", sticky / "name");
    CHECK(trust::judge(sticky / "name").why.empty());
    CHECK(trust::judge(sticky / "name").path == file);
    CHECK(trust::judge((closed / "../closed/./name").string()).path == file);
    // A user who can write to the folder of a link decides its target, be it the last part of a name or not.
    fs::create_symlink(closed, open / "folder");
    fs::create_symlink(open / "folder/code", closed / "round about");
    for (const fs::path& name : {open / "folder/code", closed / "round about"}) {
        CAPTURE(name);
        CHECK_THAT(trust::judge(name).why, Contains("everyone can write to") && Contains("/open'"));
    }
    CHECK_THAT(trust::whyNotFolder(open / "folder"), Contains("everyone can write to"));
    if (::geteuid() == 0) {
        REQUIRE(::lchown((sticky / "name").c_str(), 65534, 65534) == 0);
        CHECK_THAT(trust::judge(sticky / "name").why, Contains("is a link of another user"));
    }
    fs::create_symlink("loop", closed / "loop");
    CHECK_THAT(trust::judge(closed / "loop").why, Contains("cannot be opened"));
    CHECK_THAT(trust::judge(closed / "absent").why, Contains("cannot be opened"));
    CHECK_THAT(trust::judge(closed).why, Contains("is not a regular file"));
}

TEST_CASE("of a folder of programs all files and folders are looked at", "[trust]") {
    const TemporaryFolder folder;
    const fs::path program = folder / "program";
    fs::create_directories(program / "inner");
    for (const fs::path& path : {program, program / "inner"}) REQUIRE(::chmod(path.c_str(), 0755) == 0);
    const fs::path file = program / "inner/module.py";
    std::ofstream(file) << "pass";
    REQUIRE(::chmod(file.c_str(), 0644) == 0);
    fs::create_symlink("inner/module.py", program / "link.py");
    CHECK(trust::judgeTree(program).why.empty());
    CHECK(trust::judgeTree(program).path == fs::canonical(program));

    const auto whyWith = [&](const fs::path& path, mode_t mode) {
        struct stat before {};
        REQUIRE(::stat(path.c_str(), &before) == 0);
        REQUIRE(::chmod(path.c_str(), mode) == 0);
        const std::string why = trust::judgeTree(program).why;
        REQUIRE(::chmod(path.c_str(), before.st_mode) == 0);
        return why;
    };
    for (const auto& [path, mode] : {std::pair{program, 0777}, std::pair{program / "inner", 0777},
                                     std::pair{file, 0666}, std::pair{fs::path(folder.path()), 0777}}) {
        CAPTURE(path);
        CHECK_THAT(whyWith(path, static_cast<mode_t>(mode)), Contains("everyone can write to"));
    }
    fs::create_symlink(folder / "elsewhere.py", program / "other.py");
    std::ofstream(folder / "elsewhere.py") << "pass";
    REQUIRE(::chmod((folder / "elsewhere.py").c_str(), 0666) == 0);
    CHECK_THAT(trust::judgeTree(program).why, Contains("everyone can write to"));
}
