#include "view/http_server.h"

#include "base/error.h"
#include "base/listener.h"

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include <poll.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

namespace crt {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr std::size_t kMostConnections = 64, kMostSilent = 256;
/// File descriptors of one connection: its socket and those of its I/O context.
constexpr std::size_t kDescriptorsEach = 4;
constexpr std::chrono::milliseconds kPause{50};
constexpr std::uint64_t kMostBodyBytes = 65536;
constexpr std::uint32_t kMostHeaderBytes = 16384;
constexpr std::chrono::seconds kLongestRead{10}, kLongestWrite{30};

void closeDescriptor(int& descriptor) {
    if (descriptor >= 0) ::close(descriptor);
    descriptor = -1;
}

/// "a%20b" → "a b".
std::string decoded(std::string_view text) {
    const auto digit = [](char c) {
        if (c >= '0' && c <= '9') return c - '0';
        if (c >= 'a' && c <= 'f') return c - 'a' + 10;
        if (c >= 'A' && c <= 'F') return c - 'A' + 10;
        return -1;
    };
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool escape =
            text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0;
        if (!escape) {
            out.push_back(text[i]);
            continue;
        }
        out.push_back(static_cast<char>(16 * digit(text[i + 1]) + digit(text[i + 2])));
        i += 2;
    }
    return out;
}

/// `most`, or fewer where the file descriptors of the process, divided by `parts`, are not as many.
std::size_t withinDescriptors(std::size_t most, std::size_t parts) {
    struct rlimit limit {};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return most;
    return std::clamp<std::size_t>(static_cast<std::size_t>(limit.rlim_cur) / parts, 2, most);
}

/// Those with threads take at most half of the descriptors, those that are silent an eighth.
std::size_t mostConnections() { return withinDescriptors(kMostConnections, 2 * kDescriptorsEach); }
std::size_t mostSilent() { return withinDescriptors(kMostSilent, 8); }

HttpRequest requestOf(const http::request<http::string_body>& received) {
    HttpRequest request;
    request.method = std::string(received.method_string());
    request.body = received.body();
    const std::string target(received.target());
    const std::size_t mark = target.find('?');
    request.path = target.substr(0, mark);
    std::string_view rest = mark == std::string::npos ? "" : std::string_view(target).substr(mark + 1);
    while (!rest.empty()) {
        const std::string_view pair = rest.substr(0, rest.find('&'));
        const std::size_t equals = pair.find('=');
        if (equals != std::string_view::npos)
            request.query[decoded(pair.substr(0, equals))] = decoded(pair.substr(equals + 1));
        rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    }
    return request;
}

/// Takes the same time wherever they differ.
bool sameText(const std::string& a, const std::string& b) {
    unsigned difference = a.size() != b.size();
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
        difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
    return difference == 0;
}

}  // namespace

std::string randomToken() {
    std::array<unsigned char, 16> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        throw Error(ErrorKind::Internal, "the system gives no random numbers");
    std::string text;
    for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
    return text;
}

std::string refusal(std::uint16_t port, const std::string& host, const std::string& origin,
                    const std::string& token, const std::string& given_token) {
    const std::array<std::string, 2> own{fmt::format("127.0.0.1:{}", port),
                                         fmt::format("localhost:{}", port)};
    if (host != own[0] && host != own[1])
        return "crt view does not listen at this address: open the address that it prints";
    if (!origin.empty() && origin != "http://" + host) return "requests from other sites are refused";
    if (!sameText(given_token, token))
        return "the token is missing or wrong: open the address that crt view prints";
    return {};
}

struct HttpServer::Listening {
    asio::io_context context;
    tcp::acceptor acceptor{context};
};

/// A stream with a separate context: its thread waits for it, with a known limit.
class HttpServer::Connection {
public:
    tcp::socket& socket() { return stream_.socket(); }

    /// False: nothing came that is a request.
    bool read(http::request<http::string_body>& request) {
        http::request_parser<http::string_body> parser;
        parser.body_limit(kMostBodyBytes);
        parser.header_limit(kMostHeaderBytes);
        beast::flat_buffer buffer;
        beast::error_code result;
        stream_.expires_after(kLongestRead);
        http::async_read(stream_, buffer, parser, [&](beast::error_code e, std::size_t) { result = e; });
        context_.run();
        context_.restart();
        if (!result) request = parser.release();
        return !result;
    }
    void write(http::response<http::string_body>& response) {
        stream_.expires_after(kLongestWrite);
        http::async_write(stream_, response, [](beast::error_code, std::size_t) {});
        context_.run();
        context_.restart();
        beast::error_code none;
        socket().shutdown(tcp::socket::shutdown_send, none);
    }
    /// Ends what waits. [any thread]
    void interrupt() { ::shutdown(socket().native_handle(), SHUT_RDWR); }

    bool has_token = false;  ///< It has sent a request with the right one. Under the server's mutex.

private:
    asio::io_context context_;
    beast::tcp_stream stream_{context_};
};

HttpServer::HttpServer(std::uint16_t port, std::string token,
                       std::function<HttpReply(const HttpRequest&)> answer)
    : token_(std::move(token)), answer_(std::move(answer)), listening_(std::make_unique<Listening>()) {
    tcp::acceptor& acceptor = listening_->acceptor;
    beast::error_code error;
    acceptor.open(tcp::v4());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    acceptor.bind({asio::ip::address_v4::loopback(), port}, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error)
        throw Error(ErrorKind::Usage,
                    fmt::format("port {} is not available: {}; without --port crt uses a free one", port,
                                error.message()));
    acceptor.native_non_blocking(true);
    port_ = acceptor.local_endpoint().port();
    thread_ = std::thread([this, listener = currentListener()] {
        const ListenerScope scope(listener);
        accept();
    });
}

HttpServer::~HttpServer() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
        for (Connection* connection : open_) connection->interrupt();
    }
    // Closing it would not wake who waits there.
    ::shutdown(listening_->acceptor.native_handle(), SHUT_RDWR);
    thread_.join();
    std::unique_lock lock(mutex_);
    closed_.wait(lock, [&] { return open_.empty(); });
}

bool HttpServer::isStopping() {
    const std::lock_guard lock(mutex_);
    return stopping_;
}

void HttpServer::accept() {
    while (!isStopping()) {
        try {
            acceptSome();
        } catch (const std::exception&) {  // Out of descriptors, threads or memory: others will end.
            std::this_thread::sleep_for(kPause);
        }
    }
    for (Silent& each : silent_) closeDescriptor(each.descriptor);
}

/// Milliseconds until the oldest has been silent for too long; −1: there is none.
int HttpServer::pollTime() const {
    if (silent_.empty()) return -1;
    const auto rest = silent_.front().until - std::chrono::steady_clock::now();
    const auto whole = std::chrono::ceil<std::chrono::milliseconds>(rest).count();
    return static_cast<int>(std::max<std::int64_t>(whole, 0));
}

void HttpServer::acceptSome() {
    std::vector<pollfd> polled{{listening_->acceptor.native_handle(), POLLIN, 0}};
    for (const Silent& each : silent_) polled.push_back({each.descriptor, POLLIN, 0});
    if (::poll(polled.data(), polled.size(), pollTime()) < 0) return;
    serveThoseWhoSpeak();
    while (!silent_.empty() && silent_.front().until <= std::chrono::steady_clock::now()) {
        closeDescriptor(silent_.front().descriptor);
        silent_.pop_front();
    }
    if (polled[0].revents != 0) takeNew();
}

void HttpServer::serveThoseWhoSpeak() {
    for (Silent& each : silent_) {
        char first = 0;
        const ssize_t got = ::recv(each.descriptor, &first, 1, MSG_PEEK | MSG_DONTWAIT);
        if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
        if (got > 0 && !start(each)) break;  // They wait until there is room.
        if (got <= 0) closeDescriptor(each.descriptor);
    }
    std::erase_if(silent_, [](const Silent& each) { return each.descriptor < 0; });
}

/// Where there are too many, the oldest make room. All of those were silent a moment ago, as no more come in
/// at once than half of what there is room for.
void HttpServer::takeNew() {
    const std::size_t most = mostSilent();
    for (std::size_t taken = 0; taken < std::max<std::size_t>(most / 2, 1); ++taken) {
        const int descriptor =
            ::accept4(listening_->acceptor.native_handle(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (descriptor < 0 && (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED)) return;
        if (descriptor < 0) throw std::runtime_error("no connection can be accepted");
        if (silent_.size() >= most) {
            closeDescriptor(silent_.front().descriptor);
            silent_.pop_front();
        }
        silent_.push_back({descriptor, std::chrono::steady_clock::now() + kLongestRead});
    }
}

void HttpServer::makeRoom(std::unique_lock<std::mutex>& lock) {
    const std::size_t most = mostConnections();
    if (open_.size() < most) return;
    const auto silent = std::find_if(open_.begin(), open_.end(),
                                     [](const Connection* connection) { return !connection->has_token; });
    if (silent != open_.end()) (*silent)->interrupt();
    closed_.wait_for(lock, kPause, [&] { return open_.size() < most || stopping_; });
}

void HttpServer::close(Connection* connection) {
    open_.remove(connection);
    closed_.notify_all();
}

bool HttpServer::start(Silent& silent) {
    {
        std::unique_lock lock(mutex_);
        makeRoom(lock);
        if (stopping_ || open_.size() >= mostConnections()) return false;
    }
    auto connection = std::make_unique<Connection>();
    const std::lock_guard lock(mutex_);
    Connection* const raw = connection.get();
    open_.push_back(raw);
    try {
        connection->socket().assign(tcp::v4(), silent.descriptor);
        silent.descriptor = -1;
        std::thread([this, listener = currentListener(), own = std::move(connection)]() mutable {
            {
                const ListenerScope scope(listener);
                try {
                    serve(*own);
                } catch (const std::exception&) {  // Out of memory: the browser asks again.
                }
            }
            const std::lock_guard closing(mutex_);
            Connection* const ended = own.get();
            own.reset();
            close(ended);
        }).detach();
    } catch (...) {
        close(raw);
        throw;
    }
    return true;
}

/// One request a connection: a browser that keeps one open would keep a thread.
void HttpServer::serve(Connection& connection) {
    http::request<http::string_body> received;
    if (!connection.read(received)) return;
    const auto header = [&](http::field field) { return std::string(received[field]); };
    const HttpRequest request = requestOf(received);
    const auto given = request.query.find("token");
    const std::string why = refusal(port_, header(http::field::host), header(http::field::origin), token_,
                                    given != request.query.end() ? given->second : "");
    if (why.empty()) {
        const std::lock_guard lock(mutex_);
        connection.has_token = true;
    }
    HttpReply reply = why.empty() ? replyTo(request) : HttpReply{.status = 403, .body = why + "\n"};
    http::response<http::string_body> response{http::int_to_status(reply.status), received.version()};
    response.set(http::field::content_type, reply.type);
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : reply.headers) response.set(name, value);
    response.keep_alive(false);
    response.body() = std::move(reply.body);
    response.prepare_payload();
    connection.write(response);
}

HttpReply HttpServer::replyTo(const HttpRequest& request) {
    try {
        return answer_(request);
    } catch (const Error& error) {
        const bool asked_wrong = error.kind() == ErrorKind::Usage;
        return {.status = asked_wrong ? 400u : 500u, .body = error.what()};
    } catch (const std::exception& error) {
        return {.status = 500, .body = error.what()};
    }
}

}  // namespace crt
