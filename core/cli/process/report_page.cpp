#include "cli/process/report_page.h"

#include "base/code_trust.h"
#include "base/modules.h"
#include "cli/process/python.h"
#include "cli/process/run_program.h"
#include "cli/process/shell_line.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <sys/wait.h>

namespace crt {
namespace {

/// The last line, which is the sentence of an error in Python, too, without the name of who says it.
std::string lastLine(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    const std::size_t line = text.rfind('\n');
    if (line != std::string::npos) text.erase(0, line + 1);
    const std::string prefix = "crt: error: ";
    return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
}

std::string whyNot(const std::string& python, const EndedProgram& ended) {
    if (ended.error != 0) return fmt::format("cannot start '{}': {}", python, std::strerror(ended.error));
    if (WIFSIGNALED(ended.status))
        return fmt::format("'{}' was ended by signal {}", python, WTERMSIG(ended.status));
    const std::string said = lastLine(ended.said);
    return said.empty() ? fmt::format("'{}' ended with code {}", python, WEXITSTATUS(ended.status)) : said;
}

}  // namespace

std::optional<std::string> makeReportPage(const std::string& folder) {
    const std::string python = pythonProgram(), program = reportProgram();
    const std::string command =
        program.empty() ? shellLine({"python", "-m", "crt", "report", folder})
                        : shellLine({python.empty() ? "python3" : python, program, folder});
    if (python.empty())
        return fmt::format("no page was made, because CRT_PYTHON is empty; this command makes it: {}",
                           command);
    if (program.empty())
        return fmt::format("no page was made, because its program is not installed; this command makes it: "
                           "{}", command);
    const trust::Judged judged = trust::judgeTree(program);
    if (!judged.why.empty())
        return fmt::format("no page was made, because its program is refused: {}; after that this command "
                           "makes it: {}",
                           judged.why, command);
    // -B: nothing is written where the program is installed.
    const EndedProgram ended =
        runProgram({python, "-B", judged.path, std::filesystem::absolute(folder).string()});
    if (ended.error == 0 && ended.status == 0) return std::nullopt;
    return fmt::format("no page was made: {}; this command makes it: {}", whyNot(python, ended), command);
}

}  // namespace crt
