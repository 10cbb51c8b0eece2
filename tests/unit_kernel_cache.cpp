// The kernel cache: it finds what was stored, and nothing that happens to its directory makes it fail or
// lie.
#include "backend/sdk/kernel_cache.h"
#include "catch.h"
#include "base/temporary_folder.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <atomic>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

using crt::plugin::KernelCache;
using crt::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

using Bytes = std::vector<unsigned char>;

/// A cache in an empty directory that goes away.
struct Fixture {
    TemporaryFolder directory;

    KernelCache cache(std::uint64_t max_bytes = KernelCache::kDefaultMaxBytes) const {
        return KernelCache(directory.path().c_str(), max_bytes);
    }
    std::size_t files() const { return directory.fileCount(); }
};

Bytes bytes(std::size_t size, unsigned char first) {
    Bytes data(size);
    for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<unsigned char>(first + i * 7);
    return data;
}

KernelCache::Key keyOf(const std::string& text) { return KernelCache::makeKey({text, "-O2", "sm_90"}); }

/// Makes an entry look as if it was last used `seconds` ago.
void age(const KernelCache& cache, const KernelCache::Key& key, long seconds) {
    const timespec then{std::time(nullptr) - seconds, 0};
    const timespec times[2] = {then, then};
    REQUIRE(::utimensat(AT_FDCWD, cache.path(key).c_str(), times, 0) == 0);
}

void overwrite(const std::string& path, std::streamoff at, const std::string& text) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    REQUIRE(file);
    file.seekp(at);
    file << text;
}

}  // namespace

TEST_CASE("a stored kernel is found again", "[cache]") {
    const Fixture fixture;
    const KernelCache cache = fixture.cache();
    const Bytes kernel = bytes(100'000, 3);
    CHECK_FALSE(cache.load(keyOf("a")));
    REQUIRE(cache.store(keyOf("a"), kernel.data(), kernel.size()));
    CHECK(cache.load(keyOf("a")) == kernel);
    CHECK_FALSE(cache.load(keyOf("b")));
    CHECK(fixture.files() == 1);
    CHECK((fs::status(cache.path(keyOf("a"))).permissions() & fs::perms::all) ==
          (fs::perms::owner_read | fs::perms::owner_write));

    // Another process, later.
    CHECK(fixture.cache().load(keyOf("a")) == kernel);

    REQUIRE(cache.store(keyOf("empty"), nullptr, 0));
    CHECK(cache.load(keyOf("empty")) == Bytes{});
}

TEST_CASE("keys tell texts, order and borders apart", "[cache]") {
    CHECK(KernelCache::makeKey({"ab", "c"}) == KernelCache::makeKey({"ab", "c"}));
    CHECK(KernelCache::makeKey({"ab", "c"}) != KernelCache::makeKey({"a", "bc"}));
    CHECK(KernelCache::makeKey({"ab", "c"}) != KernelCache::makeKey({"c", "ab"}));
    CHECK(KernelCache::makeKey({"ab"}) != KernelCache::makeKey({"ab", ""}));
    CHECK(KernelCache::makeKey({"3:ab", "c"}) != KernelCache::makeKey({"3:a", "bc"}));
}

TEST_CASE("without a directory nothing is kept and nothing fails", "[cache]") {
    const KernelCache off(nullptr);
    CHECK_FALSE(off.store(keyOf("a"), "x", 1));
    CHECK_FALSE(off.load(keyOf("a")));
    CHECK(off.path(keyOf("a")).empty());

    const KernelCache nowhere("/nowhere/at/all");
    CHECK_FALSE(nowhere.store(keyOf("a"), "x", 1));
    CHECK_FALSE(nowhere.load(keyOf("a")));
}

TEST_CASE("a damaged kernel is absent, and is replaced", "[cache]") {
    const Fixture fixture;
    const KernelCache cache = fixture.cache();
    const Bytes kernel = bytes(5000, 1);
    const KernelCache::Key key = keyOf("a");
    REQUIRE(cache.store(key, kernel.data(), kernel.size()));
    const std::string path = cache.path(key);

    SECTION("its magic") { overwrite(path, 0, "X"); }
    SECTION("its version") { overwrite(path, 7, "\x7f"); }
    SECTION("its key") { overwrite(path, 9, "zz"); }
    SECTION("its size") { overwrite(path, 24, "\x01"); }
    SECTION("a size beyond all memory") { overwrite(path, 24, "\xff\xff\xff\xff\xff\xff\xff\x7f"); }
    SECTION("its checksum") { overwrite(path, 33, "zz"); }
    SECTION("one byte of the kernel") { overwrite(path, 40 + 4321, "\xee"); }
    SECTION("cut short") { fs::resize_file(path, 3000); }
    SECTION("cut within the header") { fs::resize_file(path, 20); }
    SECTION("empty") { fs::resize_file(path, 0); }
    SECTION("grown") { fs::resize_file(path, 6000); }
    SECTION("a file of another kernel under this name") {
        const Bytes other = bytes(5000, 2);
        REQUIRE(cache.store(keyOf("b"), other.data(), other.size()));
        fs::copy_file(cache.path(keyOf("b")), path, fs::copy_options::overwrite_existing);
    }
    SECTION("a directory in its place") {
        fs::remove(path);
        fs::create_directory(path);
        CHECK_FALSE(cache.load(key));
        CHECK_FALSE(cache.store(key, kernel.data(), kernel.size()));
        CHECK(fixture.files() == 1);  // no temporary file is left behind
        fs::remove(path);
    }

    CHECK_FALSE(cache.load(key));
    REQUIRE(cache.store(key, kernel.data(), kernel.size()));
    CHECK(cache.load(key) == kernel);
}

TEST_CASE("what was used longest ago goes first", "[cache]") {
    const Fixture fixture;
    const KernelCache cache = fixture.cache(4000);  // room for three and their headers
    const Bytes kernel = bytes(1200, 9);
    for (const char* name : {"a", "b", "c"}) REQUIRE(cache.store(keyOf(name), kernel.data(), kernel.size()));
    age(cache, keyOf("a"), 300);
    age(cache, keyOf("b"), 200);
    age(cache, keyOf("c"), 100);

    REQUIRE(cache.load(keyOf("a")));  // old, but used just now
    REQUIRE(cache.store(keyOf("d"), kernel.data(), kernel.size()));
    CHECK(cache.load(keyOf("a")));
    CHECK_FALSE(cache.load(keyOf("b")));
    CHECK(cache.load(keyOf("c")));
    CHECK(cache.load(keyOf("d")));

    // Larger than the whole cache: not stored, and nothing removed for it.
    const Bytes huge = bytes(5000, 1);
    CHECK_FALSE(cache.store(keyOf("huge"), huge.data(), huge.size()));
    CHECK(fixture.files() == 3);
}

TEST_CASE("only its own files are counted and removed", "[cache]") {
    const Fixture fixture;
    const KernelCache cache = fixture.cache(2000);
    std::ofstream(fixture.directory / "notes.txt") << std::string(10'000, 'n');
    std::ofstream(fixture.directory / "young.crttmp") << "being written";
    std::ofstream(fixture.directory / "old.crttmp") << "left behind";
    fs::last_write_time(fixture.directory / "old.crttmp",
                        fs::file_time_type::clock::now() - std::chrono::hours(2));

    const Bytes kernel = bytes(1500, 9);
    REQUIRE(cache.store(keyOf("a"), kernel.data(), kernel.size()));
    CHECK(cache.load(keyOf("a")) == kernel);
    CHECK(fs::exists(fixture.directory / "notes.txt"));
    CHECK(fs::exists(fixture.directory / "young.crttmp"));
    CHECK_FALSE(fs::exists(fixture.directory / "old.crttmp"));
}

TEST_CASE("many writers and readers share a directory", "[cache]") {
    const Fixture fixture;
    constexpr int threads = 8, rounds = 60, kernels = 5;
    std::atomic<int> torn{0}, hits{0};
    std::vector<std::thread> crowd;
    for (int t = 0; t < threads; ++t) {
        crowd.emplace_back([&, t] {
            // Small enough that writers evict what others are reading.
            const KernelCache cache = fixture.cache(3 * 2100);
            for (int i = 0; i < rounds; ++i) {
                // Each twice in a row: the second is found by a thread that runs alone, too.
                const int which = (t + i / 2) % kernels;
                const Bytes kernel = bytes(2000, static_cast<unsigned char>(which));
                const KernelCache::Key key = keyOf(std::to_string(which));
                if (const auto found = cache.load(key)) {
                    ++hits;
                    if (*found != kernel) ++torn;
                } else {
                    cache.store(key, kernel.data(), kernel.size());
                }
            }
        });
    }
    for (std::thread& thread : crowd) thread.join();
    CHECK(torn == 0);
    CHECK(hits > 0);
    CHECK(fixture.files() <= kernels);
    for (const fs::directory_entry& file : fs::directory_iterator(fixture.directory.path()))
        CHECK(file.path().extension() == ".crtkernel");
}
