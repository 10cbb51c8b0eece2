/// Catch's runner, compiled once for all test programs: it takes longer to compile than any test.
#pragma once

#include <functional>
#include <string>
#include <vector>

/// An option of the command line besides those of Catch: `text` takes what follows its name, `flag` becomes
/// true.
struct TestOption {
    std::string name;
    std::string help;
    std::string* text = nullptr;
    bool* flag = nullptr;
};

/// Reads the command line and runs the tests that it selects. `before`, where there is one, runs in between;
/// if it does not return 0, no test runs. Returns the exit code of the program.
int runTests(int argc, char** argv, const std::vector<TestOption>& options = {},
             const std::function<int()>& before = nullptr);
