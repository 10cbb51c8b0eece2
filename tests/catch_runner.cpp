#define CATCH_CONFIG_RUNNER
#include "catch_runner.h"

#include "catch.h"

int runTests(int argc, char** argv, const std::vector<TestOption>& options,
             const std::function<int()>& before) {
    Catch::Session session;
    for (const TestOption& option : options)
        session.cli(session.cli() | (option.text != nullptr
                                         ? Catch::Clara::Opt(*option.text, "name")[option.name](option.help)
                                         : Catch::Clara::Opt(*option.flag)[option.name](option.help)));
    if (const int code = session.applyCommandLine(argc, argv); code != 0) return code;
    if (before)
        if (const int code = before(); code != 0) return code;
    return session.run();
}
