// SPDX-License-Identifier: BSD-3-Clause
// fork, exec, pipe.
#include "children.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace outcrop {

Child::Child(const std::string &program, const std::vector<std::string> &arguments)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
    std::vector<char *> argv{const_cast<char *>(program.c_str())};
    for (const std::string &argument : arguments) argv.push_back(const_cast<char *>(argument.c_str()));
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
    if (pid_ == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        dup2(ends[1], STDOUT_FILENO);
        execv(program.c_str(), argv.data());
        const std::string text = program + ": " + std::strerror(errno) + "\n";
        if (write(STDERR_FILENO, text.data(), text.size()) < 0) _exit(126);
        _exit(127);
    }
    close(ends[1]);
    fd_ = ends[0];
    fcntl(fd_, F_SETFL, O_NONBLOCK);
}

Child::~Child()
{
    if (poll_exit() < 0) stop(2);
    close(fd_);
}

bool Child::read(const std::function<void(const std::string &)> &take)
{
    char buf[4096];
    for (;;) {
        const ssize_t n = ::read(fd_, buf, sizeof buf);
        if (n == 0) return false;
        if (n < 0) return errno == EAGAIN || errno == EINTR;
        for (ssize_t i = 0; i < n; i++) {
            if (buf[i] != '\n') {
                line_ += buf[i];
                continue;
            }
            take(line_);
            line_.clear();
        }
    }
}

int Child::poll_exit()
{
    if (status_ >= 0) return status_;
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return -1;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return status_;
}

int Child::stop(double timeout_s)
{
    using clock = std::chrono::steady_clock;
    if (poll_exit() >= 0) return status_;
    kill(pid_, SIGTERM);
    const auto end = clock::now() + std::chrono::duration<double>(timeout_s);
    while (poll_exit() < 0) {
        if (clock::now() > end) kill(pid_, SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return status_;
}

} // namespace outcrop
