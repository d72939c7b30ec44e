// Progress of a long job on stderr: percent, rate and time left. A terminal gets one line rewritten, a pipe plain lines,
// --quiet nothing. One thread reports.
#pragma once

#include <chrono>
#include <string>

namespace scree {

class Progress {
public:
    /// `unit` names what is counted in the rate, e.g. "MPix".
    Progress(std::string job, std::string unit, bool quiet);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void set_total(double total) { total_ = total; }
    /// `done` of the total; cheap enough to call once a row.
    void update(double done);
    void add(double more) { update(done_ + more); }
    void finish();

private:
    void print(double done, bool last);

    std::string job_, unit_;
    bool quiet_, terminal_;
    bool printed_ = false;
    double total_ = 1;
    double done_ = 0;
    std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace scree
