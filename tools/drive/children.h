// SPDX-License-Identifier: BSD-3-Clause
// The two daemons as child processes whose output is passed on line by line.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

namespace outcrop {

class Child {
public:
    // Starts program with arguments; standard output comes to poll_output,
    // standard error goes where ours goes. The child dies when we do.
    // Throws std::runtime_error with one line.
    Child(const std::string &program, const std::vector<std::string> &arguments);
    ~Child(); // SIGTERM, and SIGKILL after two seconds
    Child(const Child &) = delete;
    Child &operator=(const Child &) = delete;

    int fd() const { return fd_; }

    // Read what is there; calls take per whole line. False at end of output.
    bool read(const std::function<void(const std::string &)> &take);

    // Exit status (128 + signal when killed) once ended, else -1. Does not wait.
    int poll_exit();

    // SIGTERM, then wait; SIGKILL after timeout_s. Returns the exit status.
    int stop(double timeout_s);

private:
    pid_t pid_ = -1;
    int fd_ = -1;
    int status_ = -1;
    std::string line_;
};

} // namespace outcrop
