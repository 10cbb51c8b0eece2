// Texts for users: errors, log lines and stages quote files, and must stay text whatever these hold.
#include "base/error.h"
#include "base/log.h"
#include "base/stage.h"
#include "base/words.h"
#include "catch.h"

#include <string>
#include <vector>

using namespace crt;

TEST_CASE("what is printed is text, whatever is quoted") {
    CHECK(printable("caf\u00e9 \u4e2d \U0001f600\nnext") == "caf\u00e9 \u4e2d \U0001f600\nnext");
    CHECK(printable("") == "");
    CHECK(printable(std::string_view("\0abc", 4)) == "\ufffdabc");
    CHECK(printable("\x1b[2J") == "\ufffd[2J");
    CHECK(printable("a\tb\rc\x7f") == "a\ufffdb\ufffdc\ufffd");
    CHECK(printable("\u009b2J") == "\ufffd2J");  // CSI in one character
    CHECK(printable("\u00a0") == "\u00a0");      // the first character behind C1
    CHECK(printable("\xc0\xaf\xe9\xff") == "\ufffd\ufffd\ufffd\ufffd");
    CHECK(printable("end \xe4\xb8") == "end \ufffd\ufffd");
    const std::string clean = printable("\x1b\x9b");
    CHECK(printable(clean) == clean);
}

TEST_CASE("errors, messages and stages that quote a file are text") {
    const std::string name("\0\x1b[2Jx", 6), shown = "\ufffd\ufffd[2Jx";
    CHECK(Error(ErrorKind::Scene, name + " is cut off").what() == shown + " is cut off");

    std::vector<std::string> heard, stages;
    const Listener listener([&](LogLevel, std::string_view message) { heard.emplace_back(message); },
                            LogLevel::Info, [&](const std::string& what) { stages.push_back(what); });
    const ListenerScope scope(listener);
    logWarning("'{}' is left out", name);
    const Stage stage("reading " + name);
    CHECK(heard == std::vector<std::string>{"'" + shown + "' is left out"});
    CHECK(stages == std::vector<std::string>{"reading " + shown});
}
