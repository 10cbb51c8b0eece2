#include "base/code_trust.h"
#include "base/error.h"
#include "cli/commands.h"
#include "cli/process/run_program.h"
#include "cli/shared_options.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace crt {
namespace {

/// The words for the suite's program (verify/program.h), and where shared options leave their values.
struct Request {
    std::vector<std::string> words;
    std::string backend;
    IntegratorOptions integrator;
};

/// An option that the suite's program reads, by its long name. crt only checks it.
Option passedOn(Option option, Request& to) {
    const std::string name = option.names.substr(option.names.rfind("--"));
    option.read = [name, flag = option.placeholder.empty(), check = std::move(option.read),
                   &to](const std::string& text) {
        if (check) check(text);
        to.words.push_back(name);
        if (!flag) to.words.push_back(text);
    };
    return option;
}

OptionGroup passedOn(const char* title, std::vector<Option> options, Request& to) {
    for (Option& option : options) option = passedOn(std::move(option), to);
    return {title, std::move(options)};
}

OptionGroup asked(Request& to) {
    const std::vector<std::string> levels{"commit", "merge", "nightly"};
    return passedOn(
        "Cases",
        {{.names = "--case",
          .placeholder = "NAME",
          .help = "only these: ids (A03), names (furnace), groups (H), with commas or repeated",
          .read = {},
          .repeatable = true},
         {.names = "--level",
          .placeholder = "LEVEL",
          .help = "commit (a minute or so), merge (a quarter of an hour) or nightly",
          .read = {},
          .completion = completeWord(levels),
          .choices = levels},
         {.names = "--part",
          .placeholder = "I/N",
          .help = "only every N-th of these cases, from the I-th on: N runs cover all",
          .read = {}},
         {.names = "--list", .placeholder = {}, .help = "list the cases without running them", .read = {}}},
        to);
}

OptionGroup ofWhom(Request& to) {
    return passedOn("Backend",
                    {backendOption(to.backend),
                     {.names = "--plugin-path",
                      .placeholder = "DIR",
                      .help = "search for the backend here first",
                      .read = {},
                      .completion = {Completion::Kind::Folder}},
                     deviceOption(to.integrator),
                     threadsOption(to.integrator), kernelOption(to.integrator)},
                    to);
}

OptionGroup output(Request& to) {
    return passedOn(
        "Output",
        {{.names = "-o,--output",
          .placeholder = "DIR",
          .help = "write verify.json and the page verify.html (made by Python) there",
          .read = {},
          .completion = {Completion::Kind::Folder}},
         {.names = "-q,--quiet",
          .placeholder = {},
          .help = "print only failures and the summary",
          .read = {}},
         {.names = "--markdown", .placeholder = {}, .help = "print docs/stability.md instead", .read = {}},
         {.names = "--figures",
          .placeholder = "FILE",
          .help = "with --markdown: a verify.json whose numbers to include; repeatable, also for the parts "
                  "of one run",
          .read = {},
          .completion = completeFile({"json"}),
          .repeatable = true}},
        to);
}

constexpr const char* kVerifyNotes =
    "\nThe suite checks a backend against physics, geometry and arithmetic: closed forms, deterministic\n"
    "quadrature, relations between images. A case passes, does not apply (with the reason), is "
    "INCONCLUSIVE\n"
    "(the noise is too large) or FAILS. INCONCLUSIVE and FAIL give exit code 7, and the line below such a\n"
    "case suggests a cause. Cases that --case names run whatever their level. docs/stability.md describes\n"
    "every case.\n"
    "\nExamples:\n"
    "  crt verify                                          the level for every commit, on the best "
    "backend\n"
    "  crt verify --backend opencl --level merge -o out    a quarter of an hour, with out/verify.html\n"
    "  crt verify --case furnace,A03,H                     two cases and a whole group\n"
    "  crt verify --backend mine --plugin-path build       your own backend\n"
    "  crt verify --list --level nightly                   all cases\n";

constexpr const char* kSuite = "crt_conformance";

/// Does not return: the suite's program takes over, with this process's signals and exit code.
[[noreturn]] void becomeSuite(const std::vector<std::string>& words) {
    const std::string program = programBeside(kSuite);
    std::error_code unknown;
    if (!std::filesystem::exists(program, unknown))
        throw Error(ErrorKind::Usage,
                    fmt::format("crt verify runs the program {0}, and there is no '{1}'; unpack "
                                "crt-portable-tests.tar.gz over crt-portable, or build crt where Catch2 is "
                                "installed, which makes {0}",
                                kSuite, program));
    const trust::Judged judged = trust::judge(program);
    if (!judged.why.empty()) throw Error(ErrorKind::Usage, judged.why);
    std::vector<std::string> all{judged.path, "verify"};
    all.insert(all.end(), words.begin(), words.end());
    const int error = becomeProgram(std::move(all));
    throw Error(ErrorKind::Usage, fmt::format("cannot start '{}': {}", judged.path, std::strerror(error)));
}

}  // namespace

Command verifyCommand() {
    const auto to = std::make_shared<Request>();
    return {.name = "verify",
            .summary = "render scenes whose answer is known; exit code 7 when a backend does not find it",
            .groups = {asked(*to), ofWhom(*to), output(*to)},
            .notes = kVerifyNotes,
            .run = [to](const std::string&) -> int { becomeSuite(to->words); }};
}

}  // namespace crt
