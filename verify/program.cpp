#include "verify/program.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/standard_output.h"
#include "base/unit_text.h"
#include "base/words.h"
#include "cli/process/interrupt.h"
#include "cli/process/report_page.h"
#include "verify/case.h"
#include "verify/report.h"
#include "verify/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>

namespace crt::verify {
namespace {

struct Arguments {
    std::string backend = "auto";  ///< A name, a path of a plugin, or "auto".
    std::string plugin_path;       ///< A directory to look for it first; empty: none.
    IntegratorOptions integrator;
    std::vector<std::string>
        cases;  ///< Ids, names or groups, also several with commas; empty: all of the level.
    Level level = Level::Commit;
    std::size_t part = 1, parts = 1;  ///< Every `parts`-th of the cases, from number `part` on.
    std::string output;               ///< Directory for verify.json and its page; empty: none.
    bool list = false;
    bool markdown = false;            ///< Print docs/stability.md with the figures of `suites` instead.
    std::vector<std::string> suites;  ///< verify.json files.
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

/// A progress line on a terminal: the current case and the elapsed time. Cases take from a millisecond to a
/// minute, so the time left cannot be estimated from the cases that are done.
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

/// The time that each level takes, as in `crt verify --help`.
constexpr std::array<const char*, 3> kTimes{"a minute or so", "a quarter of an hour", "hours"};

/// A line where cases were asked for by name that are of a slower level than --level; else nothing.
std::string slowCasesText(const std::vector<const Case*>& cases, Level asked) {
    Level slowest = asked;
    for (const Case* const c : cases) slowest = std::max(slowest, c->level);
    if (slowest == asked) return "";
    const auto count =
        std::count_if(cases.begin(), cases.end(), [&](const Case* c) { return c->level == slowest; });
    const bool one = count == 1;
    return fmt::format(
        "{1} of {2} cases {5} of level {0}; crt runs {6} at the size of level {3} "
        "(all of level {0} takes {4})\n",
        name(slowest), count, cases.size(), name(asked), kTimes[static_cast<std::size_t>(slowest)],
        one ? "is" : "are", one ? "it" : "them");
}

void writeWhole(const std::filesystem::path& path, const std::string& text) {
    AtomicFile file(path.string());
    file.write(text.data(), text.size());
    file.commit();
}

/// Ctrl-C as a request to stop.
class SignalWatch : public Watch {
public:
    std::optional<StopRequest> stopRequested() override {
        const int signal = InterruptGuard::signalReceived();
        if (signal == 0) return std::nullopt;
        return StopRequest{signalName(signal), signalExitCode(signal)};
    }

private:
    InterruptGuard guard_;
};

int run(const Arguments& arguments) {
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

    if (!arguments.quiet) {
        printOut("{}", slowCasesText(cases, arguments.level));
        flushStandardOutput();
    }
    SignalWatch watch;
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

unsigned threadsOf(const std::string& text) {
    const Parsed<std::uint64_t> count = parseUnsigned(text);
    if (!count.value) throw Error(ErrorKind::Usage, fmt::format("--threads: {}", count.problem));
    return static_cast<unsigned>(*count.value);
}

CrtKernelChoice kernelOf(const std::string& text) {
    const std::optional<CrtKernelChoice> kernel = kernelNamed(text);
    if (!kernel)
        throw Error(ErrorKind::Usage,
                    fmt::format("--kernel takes one of {}, not '{}'", fmt::join(kKernelWords, ", "), text));
    return *kernel;
}

Level levelOf(const std::string& text) {
    const std::optional<Level> level = levelNamed(text);
    if (!level)
        throw Error(ErrorKind::Usage,
                    fmt::format("--level takes one of commit, merge, nightly, not '{}'", text));
    return *level;
}

/// An option: without `read` a flag.
struct Word {
    std::string_view name;
    void (*set)(Arguments&);
    void (*read)(Arguments&, const std::string&);
};

// `crt verify` describes them (core/cli/verify_command.cpp) and checks what it passes on.
constexpr std::array<Word, 13> kWords{{
    {"--case", nullptr, [](Arguments& a, const std::string& text) { a.cases.push_back(text); }},
    {"--level", nullptr, [](Arguments& a, const std::string& text) { a.level = levelOf(text); }},
    {"--part", nullptr, [](Arguments& a, const std::string& text) { readPart(text, a); }},
    {"--list", [](Arguments& a) { a.list = true; }, nullptr},
    {"--backend", nullptr, [](Arguments& a, const std::string& text) { a.backend = text; }},
    {"--plugin-path", nullptr, [](Arguments& a, const std::string& text) { a.plugin_path = text; }},
    {"--device", nullptr, [](Arguments& a, const std::string& text) { a.integrator.device = text; }},
    {"--threads", nullptr,
     [](Arguments& a, const std::string& text) { a.integrator.threads = threadsOf(text); }},
    {"--kernel", nullptr,
     [](Arguments& a, const std::string& text) { a.integrator.kernel = kernelOf(text); }},
    {"--output", nullptr, [](Arguments& a, const std::string& text) { a.output = text; }},
    {"--quiet", [](Arguments& a) { a.quiet = true; }, nullptr},
    {"--markdown", [](Arguments& a) { a.markdown = true; }, nullptr},
    {"--figures", nullptr, [](Arguments& a, const std::string& text) { a.suites.push_back(text); }},
}};

Arguments read(const std::vector<std::string>& words) {
    Arguments arguments;
    for (auto word = words.begin(); word != words.end(); ++word) {
        const auto known =
            std::find_if(kWords.begin(), kWords.end(), [&](const Word& w) { return w.name == *word; });
        if (known == kWords.end())
            throw Error(ErrorKind::Usage,
                        fmt::format("crt_conformance verify has no option '{}'; 'crt verify --help' lists "
                                    "them, and here they have their long names",
                                    *word));
        if (known->set != nullptr) {
            known->set(arguments);
            continue;
        }
        if (++word == words.end())
            throw Error(ErrorKind::Usage, fmt::format("{} needs a value", known->name));
        known->read(arguments, *word);
    }
    return arguments;
}

}  // namespace

int runSuite(const std::vector<std::string>& words) {
    const Arguments arguments = read(words);
    return resultWithThreads(arguments.integrator.threads, [&] { return run(arguments); });
}

}  // namespace crt::verify
