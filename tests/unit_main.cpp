// The one main of the unit tests; in a file of its own because compiling Catch's runner takes longer than
// any test.
#define CATCH_CONFIG_RUNNER
#include "base/listener.h"
#include "catch.h"

int main(int argc, char** argv) {
    const crt::Listener listener(crt::standardErrorSink());
    const crt::ListenerScope scope(listener);
    return Catch::Session().run(argc, argv);
}
