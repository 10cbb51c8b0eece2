// Kernels of the Embree backend: which of those that are compiled ahead a scene gets. Lean ones: the
// compiler that is looked for, the text and the options, the cache key, and what happens where a compiler is
// broken.
#ifdef CRT_HAVE_EMBREE_PROGRAM  // nothing to test in a build without Embree

#include "catch.h"
#include "embree_program.h"
#include "file_bytes.h"

#include "base/temporary_folder.h"
#include "compile/compile.h"
#include "kernel/dialect/features.h"
#include "scene/yaml/scene_yaml.h"

#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <set>
#include <stdexcept>

using namespace crt::embree;
using crt::spit;
using crt::TemporaryFolder;
using crt::plugin::CompileMessage;

namespace {

std::string script(const TemporaryFolder& folder, const std::string& name, const std::string& body) {
    const std::string path = folder / name;
    spit(path, "#!/bin/sh\n" + body + "\n");
    REQUIRE(::chmod(path.c_str(), 0700) == 0);
    return path;
}

/// The work of the separate process, done in this one.
std::vector<unsigned char> compiled(const std::string& compiler, const std::string& text) {
    CompileMessage message = messageOf(text, findCompiler(compiler.c_str(), nullptr), 0x1851);
    return compileJob(message);
}

}  // namespace

TEST_CASE("the compiler is the one that is named, or the first in PATH", "[embree_program]") {
    const TemporaryFolder first("/tmp"), second("/tmp");
    const std::string gpp = script(second, "g++", "exit 0");
    const std::string path = "relative:" + first.path() + ":" + second.path();
    CHECK(findCompiler(nullptr, path.c_str()).path == gpp);
    CHECK(findCompiler("", path.c_str()).path == gpp);
    const std::string clang = script(first, "clang++", "exit 0");
    CHECK(findCompiler(nullptr, path.c_str()).path == gpp);  // by name before folder
    CHECK(findCompiler("clang++", path.c_str()).path == clang);
    CHECK(findCompiler(clang.c_str(), nullptr).path == clang);
    CHECK_THROWS_WITH(findCompiler("tcc", path.c_str()), Contains("no compiler 'tcc' (CRT_CXX)"));
    CHECK_THROWS_WITH(findCompiler(first.path().c_str(), path.c_str()), Contains("no compiler"));
    CHECK_THROWS_WITH(findCompiler(nullptr, "relative"), Contains("no C++ compiler (c++, g++ or clang++)"));
    CHECK_THROWS_WITH(findCompiler(nullptr, nullptr), Contains("no C++ compiler"));
}

TEST_CASE("a compiler that was replaced is another one", "[embree_program]") {
    const TemporaryFolder folder("/tmp");
    const std::string path = script(folder, "g++", "exit 0");
    const Compiler before = findCompiler(path.c_str(), nullptr);
    CHECK(findCompiler(path.c_str(), nullptr).identity == before.identity);
    script(folder, "g++", "exit 1 # longer");
    const Compiler after = findCompiler(path.c_str(), nullptr);
    CHECK(after.identity != before.identity);
    const std::set<crt::plugin::KernelCache::Key> keys = {
        cacheKey("text", before, 0x51), cacheKey("text", after, 0x51), cacheKey("text ", before, 0x51),
        cacheKey("text", before, 0x50)};
    CHECK(keys.size() == 4);
    CHECK(keys.count(cacheKey("text", before, 0x51)) == 1);
}

TEST_CASE("a kernel is compiled when its render is long enough to gain from it", "[embree_program]") {
    CHECK(compileAfterSeconds(false, false, nullptr) == kSecondsBeforeCompiling);
    CHECK(compileAfterSeconds(false, true, nullptr) == kSecondsBeforeCompiling);
    CHECK(compileAfterSeconds(true, true, nullptr) == kSecondsBeforeVectorizing);
    for (const char* const said : {static_cast<const char*>(nullptr), "0"})
        CHECK(!compileAfterSeconds(true, false, said));
    for (const bool is_lean_enough : {false, true}) {
        CHECK(compileAfterSeconds(is_lean_enough, true, "0") == 0);
        CHECK(compileAfterSeconds(is_lean_enough, true, "2.5") == 2.5);
        for (const char* const nonsense : {"", "-1", "4s", "nan", "soon"})
            CHECK(compileAfterSeconds(is_lean_enough, true, nonsense) ==
                  compileAfterSeconds(is_lean_enough, true, nullptr));
    }
}

TEST_CASE("no option of a lean kernel relaxes arithmetic", "[embree_program]") {
    for (const char* const identity : {"/usr/bin/g++-12 1 2", "/usr/bin/clang-14 1 2"}) {
        const std::vector<std::string> options = compilerOptions({"c++", identity}, 0x1851);
        const auto has = [&](const std::string& option) {
            return std::find(options.begin(), options.end(), option) != options.end();
        };
        CHECK(has("-ffp-contract=off"));
        CHECK(has("-march=x86-64-v3"));
        CHECK(has("-march=x86-64-v4") == (__builtin_cpu_supports("avx512vl") != 0));
        CHECK(has("-DCRT_FEATURES=0x1851ul"));
        for (const std::string& option : options) CHECK(option.find("fast") == std::string::npos);
        const bool of_gcc = std::any_of(options.begin(), options.end(), [](const std::string& option) {
            return option.rfind("--param=", 0) == 0;
        });
        CHECK(of_gcc == (std::string(identity).find("clang") == std::string::npos));
    }
}

TEST_CASE("the text of a lean kernel is one file", "[embree_program]") {
    const std::string text = kernelText("#define CRT_PIXEL_H\n");
    CHECK(text.find("#include \"") == std::string::npos);
    const std::size_t job = text.find("struct TileJob"), pixel = text.find("#define CRT_PIXEL_H"),
                      traversal = text.find("closestHit("), entry = text.find("CRT_EMBREE_ENTRY(");
    CHECK(job < pixel);
    CHECK(pixel < traversal);
    CHECK(traversal < entry);
    REQUIRE(entry != std::string::npos);
    CHECK(text.find("struct TileJob", job + 1) == std::string::npos);
}

TEST_CASE("no kernel that is compiled ahead is smaller than the chosen one", "[embree_program]") {
    CHECK(allPrecompiled().back().features == CRT_FEATURES_ALL);
    for (const auto& file : std::filesystem::directory_iterator(CRT_SOURCE_DIR "/configs")) {
        if (file.path().extension() != ".yaml") continue;
        const std::uint64_t needed = crt::compileScene(crt::loadScene(file.path()), 0).header().features;
        const Precompiled& chosen = choosePrecompiled(needed, CRT_KERNEL_LEAN);
        INFO(file.path().filename() << ": " << chosen.name);
        CHECK((needed & ~chosen.features) == 0);
        for (const Precompiled& other : allPrecompiled())
            if ((needed & ~other.features) == 0)
                CHECK(std::popcount(other.features) >= std::popcount(chosen.features));
        for (const char* covered : {"room", "lamps", "lens", "product", "instruments", "materials", "soap"})
            if (file.path().stem() == covered) CHECK(chosen.features != CRT_FEATURES_ALL);
        CHECK(choosePrecompiled(needed, CRT_KERNEL_FULL).features == CRT_FEATURES_ALL);
    }
}

TEST_CASE("a compiler that refuses, crashes or says nothing is quoted", "[embree_program]") {
    const TemporaryFolder folder("/tmp");
    CHECK_THROWS_WITH(
        compiled(script(folder, "a", "echo 'In file included'; echo 'a.cpp:1: error: no' >&2; exit 1"), ""),
        Contains("cannot compile the kernel: a.cpp:1: error: no"));
    CHECK_THROWS_WITH(compiled(script(folder, "b", "exit 3"), ""), Contains("it said nothing"));
    CHECK_THROWS_WITH(compiled(script(folder, "c", "kill -9 $$"), ""), Contains("signal 9"));
    CHECK_THROWS_WITH(compiled(script(folder, "d", "exit 0"), ""), Contains("it has made no library"));
}

TEST_CASE("what is no kernel is not loaded", "[embree_program]") {
    CHECK_THROWS_WITH(LeanKernel({}), Contains("cannot be loaded"));
    CHECK_THROWS_WITH(LeanKernel({'E', 'L', 'F'}), Contains("cannot be loaded"));
    const Compiler compiler = findCompiler(nullptr, std::getenv("PATH"));
    CHECK_THROWS_WITH(LeanKernel(compiled(compiler.path, "int x;")), Contains("has no entry"));
    CHECK_THROWS_WITH(compiled(compiler.path, "int x"), Contains("error"));
}

TEST_CASE("two kernels are loaded beside each other", "[embree_program]") {
    const Compiler compiler = findCompiler(nullptr, std::getenv("PATH"));
    const auto named = [&](const char* name) {
        return LeanKernel(
            compiled(compiler.path, std::string("extern \"C\" [[gnu::visibility(\"default\")]] "
                                                "void crt_embree_render() {}\n"
                                                "extern \"C\" [[gnu::visibility(\"default\")]] "
                                                "const char crt_embree_compiler[] = \"") +
                                        name + "\";\n"));
    };
    const LeanKernel first = named("first"), second = named("second");
    CHECK(first.compiler() == "first");
    CHECK(second.compiler() == "second");
    CHECK(first.render() != second.render());
}

#endif
