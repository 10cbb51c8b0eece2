// The one main of the unit tests.
#include "base/listener.h"
#include "catch_runner.h"

int main(int argc, char** argv) {
    const crt::Listener listener(crt::standardErrorSink());
    const crt::ListenerScope scope(listener);
    return runTests(argc, argv);
}
