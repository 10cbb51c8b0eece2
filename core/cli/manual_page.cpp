#include "cli/manual_page.h"

#include "cli/command_line.h"

#include <fmt/format.h>

#include <array>
#include <string_view>

namespace crt {
namespace {

/// Text as roff takes it. A hyphen that is typed is a minus there, or copying it from the page would fail.
std::string escaped(std::string_view text) {
    std::string roff;
    bool line_begins = true;
    for (const char c : text) {
        if (line_begins && (c == '.' || c == '\'')) roff += "\\&";
        if (c == '\\') {
            roff += "\\e";
        } else if (c == '-') {
            roff += "\\-";
        } else {
            roff += c;
        }
        line_begins = c == '\n';
    }
    return roff;
}

std::string withoutEdges(const std::string& text) {
    const std::size_t first = text.find_first_not_of('\n'), last = text.find_last_not_of('\n');
    return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
}

/// As it stands: examples and tables are laid out already.
std::string verbatim(const std::string& text) {
    return fmt::format(".nf\n{}\n.fi\n", escaped(withoutEdges(text)));
}

std::string entry(const std::string& term, const std::string& help) {
    return fmt::format(".TP\n{}\n{}\n", term, escaped(help));
}

std::string optionTerm(const Option& option) {
    std::string names;
    for (std::size_t begin = 0; begin <= option.names.size();) {
        const std::size_t end = std::min(option.names.find(',', begin), option.names.size());
        names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ",
                             escaped(option.names.substr(begin, end - begin)));
        begin = end + 1;
    }
    return option.placeholder.empty() ? names
                                      : fmt::format("{} \\fI{}\\fR", names, escaped(option.placeholder));
}

std::string usage(const Command& command) {
    std::string words;
    for (const Argument& argument : command.arguments) {
        const std::string name =
            fmt::format("\\fI{}\\fR{}", argument.name, argument.repeatable ? "..." : "");
        words += argument.required ? " " + name : fmt::format(" [{}]", name);
    }
    return fmt::format("\\fBcrt {}\\fR{} [\\fIoptions\\fR]", command.name, words);
}

std::string section(const Command& command) {
    std::string text = fmt::format(".SS {}\n{}.\n.PP\n{}\n", usage(command), escaped(command.summary), "");
    for (const Argument& argument : command.arguments)
        text += entry(fmt::format("\\fI{}\\fR", argument.name), argument.help);
    for (const OptionGroup& group : command.groups) {
        text += fmt::format(".PP\n{}:\n", escaped(group.title));
        for (const Option& option : group.options) text += entry(optionTerm(option), option.help);
    }
    // The examples of the command that needs no name are those of the program.
    if (!command.notes.empty() && command.notes != programExamples())
        text += ".PP\n" + verbatim(command.notes);
    return text;
}

struct Variable {
    const char *name, *what;
};

constexpr std::array kVariables{
    Variable{"CRT_BACKEND", "The backend, unless --backend is given."},
    Variable{"CRT_DEVICE", "The device, unless --device is given."},
    Variable{"CRT_BACKEND_PATH", "Folders searched for backends first, separated by colons."},
    Variable{"CRT_MESH_PATH", "Folders searched for meshes and spectra that are not in the scene's folder."},
    Variable{"CRT_DATA_PATH", "Folders searched for named data before those of crt."},
    Variable{"CRT_PYTHON",
             "The Python that makes the pages of converge and verify, instead of python3; empty: make no "
             "pages."},
    Variable{"CRT_CACHE_DIR",
             "The folder for compiled kernels and tables of materials, instead of crt in $XDG_CACHE_HOME or "
             "~/.cache."},
    Variable{"CRT_KERNEL_DIR", "Kernel headers to be compiled instead of those in the program."},
    Variable{"CRT_OPENCL_WAVES",
             "1: OpenCL renders scenes of many materials on a processor as it does on a GPU, for tests."},
    Variable{
        "CRT_CXX",
        "The C++ compiler of lean Embree kernels, instead of the first of c++, g++ and clang++ in PATH."},
    Variable{"CRT_COMPILE_AFTER",
             "Seconds of rendering, of all processors together, after which the Embree backend compiles a "
             "lean kernel, instead of 4, or 60 where only AVX-512 makes it faster."},
    Variable{"CUDA_HOME", "The path of NVRTC, if the system does not find it."},
    Variable{"CRT_SCENE_MEMORY",
             "The maximum memory of a scene after its placements and aliases are expanded, such as 20GB."},
    Variable{"CRT_TABLE_SECONDS",
             "The maximum processor time, in seconds, for the tables of rough materials, instead of 6."},
    Variable{"SOURCE_DATE_EPOCH", "Seconds since 1970 that images and films carry as their date."},
    Variable{"NO_COLOR", "If set, crt verify prints without colours."},
};

}  // namespace

std::string manualPage(const std::vector<Command>& commands) {
    std::string text = fmt::format(".TH CRT 1 \"\" \"crt {}\" \"User Commands\"\n", CRT_VERSION);
    text += ".SH NAME\ncrt \\- spectral path tracer with the same bits from every backend\n";
    text += ".SH SYNOPSIS\n";
    text += "\\fBcrt\\fR [\\fBrender\\fR] \\fISCENE\\fR [\\fIoptions\\fR]\n.br\n";
    text += "\\fBcrt\\fR \\fICOMMAND\\fR [\\fIoptions\\fR]\n";
    text += fmt::format(".SH DESCRIPTION\n{}\n", escaped(programSummary()));
    text += ".SH COMMANDS\n";
    for (const Command& command : commands) text += section(command);
    text += ".SH EXAMPLES\n" + verbatim(programExamples().substr(programExamples().find(":\n") + 2));
    text += ".SH ENVIRONMENT\n";
    for (const Variable& variable : kVariables)
        text += entry(fmt::format("\\fB{}\\fR", variable.name), variable.what);
    text += ".SH EXIT STATUS\n";
    const std::string codes = programExitCodes();
    text += escaped(withoutEdges(codes.substr(codes.find(": ") + 2))) + "\n";
    return text;
}

}  // namespace crt
