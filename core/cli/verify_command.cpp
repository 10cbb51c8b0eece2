#include "base/atomic_file.h"
#include "base/error.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/standard_output.h"
#include "base/unit_text.h"
#include "cli/commands.h"
#include "cli/report_page.h"
#include "cli/shared_options.h"
#include "cli/terminal_watch.h"
#include "judge/verify/case.h"
#include "judge/verify/report.h"
#include "judge/verify/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace crt {
namespace verify {
namespace {

struct Arguments {
    std::string backend = "auto";          ///< A name, a path of a plugin, or "auto".
    std::string plugin_path;               ///< A directory to look for it first; empty: none.
    IntegratorOptions integrator;
    std::vector<std::string>
        cases;  ///< Ids, names or groups, also several with commas; empty: all of the level.
    Level level = Level::Commit;
    std::size_t part = 1, parts = 1;       ///< Every `parts`-th of the cases, from number `part` on.
    std::string output;                    ///< Directory for verify.json and its page; empty: none.
    bool list = false;
    bool markdown = false;                 ///< Print docs/stability.md with the figures of `suites` instead.
    std::vector<std::string> suites;       ///< verify.json files.
    bool quiet = false;
};

constexpr int kFailed = 7;

std::vector<std::string> splitAtCommas(const std::vector<std::string>& lists) {
    std::vector<std::string> words;
    for (const std::string& list : lists) {
        std::istringstream in(list);
        for (std::string word; std::getline(in, word, ',');)
            if (!word.empty()) words.push_back(word);
    }
    return words;
}

void readPart(const std::string& text, Arguments& to) {
    const char* const end = text.data() + text.size();
    const auto [slash, failed] = std::from_chars(text.data(), end, to.part);
    const bool has_slash = failed == std::errc{} && slash != end && *slash == '/';
    if (!has_slash || std::from_chars(slash + 1, end, to.parts).ptr != end || to.part < 1 ||
        to.part > to.parts)
        throw Error(ErrorKind::Usage,
                    fmt::format("--part takes I/N, from 1/N to N/N, such as 2/4, not '{}'", text));
}

std::vector<const Case*> partOf(const std::vector<const Case*>& all, std::size_t part, std::size_t parts) {
    std::vector<const Case*> some;
    for (std::size_t i = part - 1; i < all.size(); i += parts) some.push_back(all[i]);
    return some;
}

void lookFirstIn(const std::string& directory) {
    if (!std::filesystem::is_directory(directory))
        throw Error(
            ErrorKind::Usage,
            fmt::format(
                "--plugin-path '{}' is not a directory; name the one that holds crt_backend_<name>.so",
                directory));
    const char* others = std::getenv("CRT_BACKEND_PATH");
    const std::string path =
        fmt::format("{}:{}", std::filesystem::absolute(directory).string(), others != nullptr ? others : "");
    setenv("CRT_BACKEND_PATH", path.c_str(), 1);
}

std::string readText(const std::string& file) {
    try {
        return readInput(file, kMostTableBytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Usage, fmt::format("'{}' {}", file, refused.what()));
    }
}

/// The line on a terminal that tells which case runs, and since when. Cases take from a millisecond to a
/// minute: what is left cannot be told from what is done.
class Line {
public:
    Line(std::size_t cases, bool quiet) : cases_(cases), shown_(!quiet && isatty(STDERR_FILENO) != 0) {}

    void before(const Case& next, std::size_t index) {
        if (!shown_) return;
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
        fmt::print(stderr, "\r\033[K  {} of {}, {} so far: {} {}", index + 1, cases_, clockText(seconds),
                   next.id, next.title);
        std::fflush(stderr);
    }
    void clear() const {
        if (shown_) fmt::print(stderr, "\r\033[K");
    }

private:
    std::size_t cases_;
    bool shown_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void writeWhole(const std::filesystem::path& path, const std::string& text) {
    AtomicFile file(path.string());
    file.write(text.data(), text.size());
    file.commit();
}

/// Exit code: 0 when every case passes, is refused as documented or does not apply; 7 when one fails or is
/// inconclusive; 128 + signal when interrupted. Throws crt::Error.
int verify(const Arguments& arguments) {
    if (arguments.markdown) {
        std::vector<std::string> suites;
        for (const std::string& file : arguments.suites) suites.push_back(readText(file));
        printOut("{}", registryMarkdown(suites));
        return 0;
    }
    const std::vector<const Case*> cases =
        partOf(select(splitAtCommas(arguments.cases), arguments.level), arguments.part, arguments.parts);
    if (arguments.list) {
        printOut("{}", listText(cases));
        return 0;
    }
    if (!arguments.output.empty()) makeOutputFolder(arguments.output);
    if (!arguments.plugin_path.empty()) lookFirstIn(arguments.plugin_path);
    const LoadedBackend backend = openBackend(arguments.backend);
    // Cases warn about scenes that are odd on purpose.
    setLogLevel(LogLevel::Error);

    TerminalWatch watch(ProgressMode::None, TerminalWatch::Signals::Always);
    Line line(cases.size(), arguments.quiet);
    const bool colored = isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
    const SuiteResult suite = runCases(
        backend, arguments.integrator, arguments.level, cases,
        [&](const Case& next, std::size_t index, const CaseResult* result) {
            if (result == nullptr) {
                line.before(next, index);
                return;
            }
            line.clear();
            if (!arguments.quiet || failed(result->verdict)) printOut("{}", caseText(*result, colored));
            flushStandardOutput();
        },
        watch);
    printOut("{} on {}, level {}: {}\n", suite.backend, suite.device, name(suite.level), summaryText(suite));
    if (!arguments.output.empty()) {
        writeWhole(std::filesystem::path(arguments.output) / "verify.json", suiteJson(suite));
        if (const std::optional<std::string> missing = makeReportPage(arguments.output))
            printOut("{}/verify.json has every figure; {}\n", arguments.output, *missing);
        else
            printOut("{0}/verify.html and {0}/verify.json have every figure\n", arguments.output);
    }
    if (suite.request) return suite.request->exit_code;
    return suite.passed() ? 0 : kFailed;
}

OptionGroup asked(Arguments& to) {
    const std::vector<std::string> levels{"commit", "merge", "nightly"};
    return {"Cases",
            {{.names = "--case",
              .placeholder = "NAME",
              .help = "only these: ids (A03), names (furnace), groups (H), with commas or repeated",
              .read = [&to](const std::string& text) { to.cases.push_back(text); },
              .repeatable = true},
             {.names = "--level",
              .placeholder = "LEVEL",
              .help = "commit (a minute or so), merge (a quarter of an hour) or nightly",
              .read = [&to](const std::string& text) { to.level = *levelNamed(text); },
              .completion = completeWord(levels),
              .choices = levels},
             {.names = "--part",
              .placeholder = "I/N",
              .help = "only every N-th of these cases, starting at the I-th: N runs cover all cases",
              .read = [&to](const std::string& text) { readPart(text, to); }},
             {.names = "--list",
              .placeholder = {},
              .help = "list the cases without running them",
              .read = [&to](const std::string&) { to.list = true; }}}};
}

OptionGroup ofWhom(Arguments& to) {
    return {"Of whom",
            {backendOption(to.backend),
             {.names = "--plugin-path",
              .placeholder = "DIR",
              .help = "search for the backend here first",
              .read = [&to](const std::string& text) { to.plugin_path = text; },
              .completion = {Completion::Kind::Folder}},
             deviceOption(to.integrator), threadsOption(to.integrator)}};
}

OptionGroup output(Arguments& to) {
    return {"Output",
            {{.names = "-o,--output",
              .placeholder = "DIR",
              .help = "write verify.json and the page verify.html (made by Python) there",
              .read = [&to](const std::string& text) { to.output = text; },
              .completion = {Completion::Kind::Folder}},
             {.names = "-q,--quiet",
              .placeholder = {},
              .help = "print only failures and the summary",
              .read = [&to](const std::string&) { to.quiet = true; }},
             {.names = "--markdown",
              .placeholder = {},
              .help = "print docs/stability.md instead",
              .read = [&to](const std::string&) { to.markdown = true; }},
             {.names = "--figures",
              .placeholder = "FILE",
              .help = "with --markdown: a verify.json whose numbers to include; repeatable",
              .read = [&to](const std::string& text) { to.suites.push_back(text); },
              .completion = completeFile({"json"}),
              .repeatable = true}}};
}

constexpr const char* kVerifyNotes =
            "\nThe suite checks a backend against physics, geometry and arithmetic: closed forms, "
            "deterministic quadrature, relations between\n"
            "images. A case passes, is refused as documented, does not apply (with the reason), is "
            "INCONCLUSIVE (the noise is too large) or\n"
            "FAILS; the last two make the exit code 7, and the line below suggests a cause. "
            "docs/stability.md describes every case.\n"
            "\nExamples:\n"
            "  crt verify                                          the level for every commit, on the best "
            "backend\n"
            "  crt verify --backend opencl --level merge -o out    a few minutes, with out/verify.json and "
            "out/verify.html\n"
            "  crt verify --case furnace,A03,H                     two cases and a whole group\n"
            "  crt verify --backend mine --plugin-path build       a backend of your own\n"
            "  crt verify --list --level nightly                   all cases\n";

}  // namespace
}  // namespace verify

Command verifyCommand() {
    const auto to = std::make_shared<verify::Arguments>();
    return {.name = "verify",
            .summary = "render scenes with known results; exit code 7 if a backend does not reproduce them",
            .groups = {verify::asked(*to), verify::ofWhom(*to), verify::output(*to)},
            .notes = verify::kVerifyNotes,
            .run = [to](const std::string&) {
                return resultWithThreads(to->integrator.threads, [&] { return verify::verify(*to); });
            }};
}

}  // namespace crt
