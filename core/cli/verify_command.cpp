#include "cli/verify_command.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/input_file.h"
#include "base/log.h"
#include "base/standard_output.h"
#include "base/unit_text.h"
#include "cli/terminal_watch.h"
#include "judge/verify/report.h"
#include "judge/verify/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <sstream>

namespace crt::verify {
namespace {

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

void lookFirstIn(const std::string& directory) {
    if (!std::filesystem::is_directory(directory))
        throw Error(
            ErrorKind::Usage,
            fmt::format(
                "--plugin-path '{}' is not a directory; it should be the one with crt_backend_<name>.so",
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

void writeReports(const std::string& directory, const SuiteResult& suite) {
    const std::filesystem::path folder(directory);
    writeWhole(folder / "verify.json", suiteJson(suite));
    writeWhole(folder / "verify.html", suiteHtml(suite));
}

}  // namespace

int verify(const Arguments& arguments) {
    if (arguments.markdown) {
        std::vector<std::string> suites;
        for (const std::string& file : arguments.suites) suites.push_back(readText(file));
        printOut("{}", registryMarkdown(suites));
        return 0;
    }
    const std::vector<const Case*> cases = select(splitAtCommas(arguments.cases), arguments.level);
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
        writeReports(arguments.output, suite);
        printOut("{0}/verify.html and {0}/verify.json have every figure\n", arguments.output);
    }
    if (suite.request) return suite.request->exit_code;
    return suite.passed() ? 0 : kFailed;
}

}  // namespace crt::verify
