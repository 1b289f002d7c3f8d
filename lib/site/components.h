// SPDX-License-Identifier: BSD-3-Clause
// Disjoint sets: plain, and with at most one member per view.
#pragma once

#include <cstddef>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace outcrop {

// Union-find over 0..n-1. The root of a set is its least member, so results do not depend on the order of joins.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

    int root(int i)
    {
        while (parent_[at(i)] != i) {
            parent_[at(i)] = parent_[at(parent_[at(i)])];
            i = parent_[at(i)];
        }
        return i;
    }

    // The root of the joined set.
    int join(int a, int b)
    {
        a = root(a), b = root(b);
        if (b < a) std::swap(a, b);
        parent_[at(b)] = a;
        return a;
    }

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    std::vector<int> parent_;
};

// Sightings of points: two of one view are never the same point, so such sets do not join.
class ViewComponents {
public:
    // view_of: the view of each member.
    explicit ViewComponents(const std::vector<int> &view_of) : sets_(view_of.size()), views_(view_of.size())
    {
        for (std::size_t i = 0; i < view_of.size(); ++i) views_[i].insert(view_of[i]);
    }

    int root(int i) { return sets_.root(i); }

    // False, and nothing done, when both sides see the same view.
    bool join(int a, int b)
    {
        a = sets_.root(a), b = sets_.root(b);
        if (a == b) return true;
        std::set<int> &of_a = views_[static_cast<std::size_t>(a)], &of_b = views_[static_cast<std::size_t>(b)];
        for (const int view : of_b)
            if (of_a.count(view)) return false;
        of_a.insert(of_b.begin(), of_b.end());
        of_b.clear();
        const int root = sets_.join(a, b);
        if (root == b) of_b.swap(of_a);
        return true;
    }

private:
    DisjointSets sets_;
    std::vector<std::set<int>> views_;
};

} // namespace outcrop
