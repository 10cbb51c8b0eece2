#include "cli/process/python.h"

#include "cli/process/run_program.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

namespace crt {
namespace {

/// Ends with code 0 where there is a package crt that imports scenes of others: PyPI has another package of
/// the name. Modules in the working directory are not run.
constexpr const char* kPackageIsThere =
    "import importlib.util, os, sys\n"
    "sys.path[:] = [folder for folder in sys.path if folder]\n"
    "found = importlib.util.find_spec('crt')\n"
    "places = found and found.submodule_search_locations or []\n"
    "sys.exit(not any(os.path.isfile(os.path.join(place, 'foreign_scenes.py')) for place in places))\n";

/// python -m crt, but for the working directory. A missing module ends with a sentence: users need not know
/// that Python does the work.
constexpr const char* kRunPackage =
    "import runpy, sys\n"
    "sys.path[:] = [folder for folder in sys.path if folder]\n"
    "try:\n"
    "    runpy.run_module('crt', run_name='__main__', alter_sys=True)\n"
    "except ModuleNotFoundError as missing:\n"
    "    print(f'crt: error: the Python package that does this needs the '\n"
    "          f'module {missing.name!r}, which {sys.executable} lacks; install it '\n"
    "          f'({sys.executable} -m pip install {missing.name}), or name another Python in CRT_PYTHON',\n"
    "          file=sys.stderr)\n"
    "    sys.exit(3)\n";

}  // namespace

std::string pythonProgram() {
    const char* const named = std::getenv("CRT_PYTHON");
    return named != nullptr ? named : "python3";
}

void becomePythonPackage(const std::vector<std::string>& arguments) {
    const std::string python = pythonProgram();
    if (python.empty()) return;
    const EndedProgram looked = runProgram({python, "-c", kPackageIsThere});
    if (looked.error != 0 || looked.status != 0) return;
    std::error_code unknown;
    if (const auto self = std::filesystem::read_symlink("/proc/self/exe", unknown); !unknown)
        ::setenv("CRT_PROGRAM", self.c_str(), 1);
    std::vector<std::string> words{python, "-c", kRunPackage};
    words.insert(words.end(), arguments.begin(), arguments.end());
    for (const int ignored : {SIGPIPE, SIGXFSZ}) std::signal(ignored, SIG_DFL);
    becomeProgram(std::move(words));
}

}  // namespace crt
