// Compilers in separate processes: left behind, taken over, and ended. Scripts stand in for the programs.
#include "backend/sdk/compile_process.h"

#include "base/temporary_folder.h"
#include "catch.h"
#include "file_bytes.h"

#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <thread>

using namespace crt;
using plugin::CompileMessage;
using plugin::CompilePlace;
using plugin::CompileProcess;

namespace {

/// A program that says in `began` that it has started, waits for the file `go`, and answers that it failed
/// ("bad", after its length in 64 bits).
std::string waitingProgram(const TemporaryFolder& folder) {
    const std::string path = folder / "program";
    spit(path, "#!/bin/sh\necho $$ >> " + (folder / "began") + "\nwhile [ ! -e " + (folder / "go") +
                   " ]; do sleep 0.01; done\nprintf '\\003\\0\\0\\0\\0\\0\\0\\0bad'\n");
    REQUIRE(::chmod(path.c_str(), 0700) == 0);
    return path;
}

std::string textOf(const std::string& path) { return std::filesystem::exists(path) ? slurp(path) : ""; }

/// Waits, within a patience that only ends hangs.
template <class Condition>
bool becomes(const Condition& condition) {
    for (int i = 0; i < 60000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

std::string failureOf(CompileProcess& process) {
    std::string failure;
    becomes([&] {
        try {
            return process.poll().has_value();
        } catch (const std::runtime_error& error) {
            failure = error.what();
            return true;
        }
    });
    return failure;
}

std::size_t linesIn(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("a compiler that was left behind is taken over, not started again", "[compile_process]") {
    const TemporaryFolder folder;
    const std::string program = waitingProgram(folder), began = folder / "began";
    const CompilePlace place{folder.path(), {1}}, other{folder.path(), {2}};
    { CompileProcess first(program, place, CompileMessage()); }
    REQUIRE(becomes([&] { return linesIn(textOf(began)) == 1; }));
    CHECK(CompileProcess::mayStart(place, 1));
    CHECK_FALSE(CompileProcess::mayStart(other, 1));
    CHECK(CompileProcess::mayStart(other, 2));
    { CompileProcess second(program, place, CompileMessage()); }
    CompileProcess third(program, place, CompileMessage());
    CHECK_FALSE(third.poll());
    spit(folder / "go", "");
    CHECK(failureOf(third) == "bad");
    CHECK(linesIn(textOf(began)) == 1);
    CHECK(CompileProcess::mayStart(other, 1));
    CHECK_THROWS_WITH(third.poll(), Contains("already in use"));
}

TEST_CASE("kernels of other places are compiled by other processes", "[compile_process]") {
    const TemporaryFolder folder, elsewhere;
    const std::string program = waitingProgram(folder), began = folder / "began";
    { CompileProcess first(program, {folder.path(), {1}}, CompileMessage()); }
    CompileProcess second(program, {folder.path(), {2}}, CompileMessage());
    CompileProcess third(program, {elsewhere.path(), {1}}, CompileMessage());
    CHECK(becomes([&] { return linesIn(textOf(began)) == 3; }));
    spit(folder / "go", "");
    CHECK(failureOf(second) == "bad");
    CHECK(failureOf(third) == "bad");
}

TEST_CASE("without a cache a compiler ends with the render, and what it has started, too",
          "[compile_process]") {
    const TemporaryFolder folder;
    const std::string program = folder / "program", child = folder / "child";
    spit(program, "#!/bin/sh\nsleep 1000 &\necho $! > " + child + "\nwait\n");
    REQUIRE(::chmod(program.c_str(), 0700) == 0);
    {
        CompileProcess process(program, {}, CompileMessage());
        REQUIRE(becomes([&] { return linesIn(textOf(child)) == 1; }));
    }
    const pid_t id = std::stoi(textOf(child));
    // Until the system has taken it away it may be there as a zombie.
    const auto gone = [&] {
        const std::string status = textOf("/proc/" + std::to_string(id) + "/stat");
        return ::kill(id, 0) != 0 || status.find(") Z ") != std::string::npos;
    };
    CHECK(becomes(gone));
}

TEST_CASE("a program that cannot be started, or crashes, is an error", "[compile_process]") {
    const TemporaryFolder folder;
    CHECK_THROWS(CompileProcess(folder / "nothing", {}, CompileMessage()));
    const std::string program = folder / "program";
    spit(program, "#!/bin/sh\nkill -11 $$\n");
    REQUIRE(::chmod(program.c_str(), 0700) == 0);
    CompileProcess crashed(program, {}, CompileMessage());
    CHECK_THAT(failureOf(crashed), Contains("signal 11"));
    spit(program, "#!/bin/sh\necho x\n");
    CompileProcess short_answer(program, {}, CompileMessage());
    CHECK_THAT(failureOf(short_answer), Contains("incomplete"));
}
