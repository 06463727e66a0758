// The Cholesky factor of Â + CᵀΘC: by rows for small crowds, by fronts for large ones.
#pragma once

#include <optional>

#include "fronts.hpp"
#include "rows.hpp"

namespace nscd {

// What may be set otherwise in tests.
struct Sizes {
    int multifrontal = 1500;      // from this many disks on the multifrontal factorisation is the faster one (see benchmarks)
    int shared = SHARED;  // from this many disks on threads work on parts of a crowd
    int leaf = 8;         // parts of up to so many disks are not cut further
};

class Factor {
public:
    // Order the disks of a problem. kept: the order of a crowd, of which these are disks `disk`.
    Factor(const System& problem, Team& team, const Sizes& sizes, ReusableOrder* reusable = nullptr, std::span<const Index> disk = {});

    const System& system() const { return system_; }  // the problem in elimination order
    const Parts& parts() const { return parts_; }
    Team& team() const { return team_; }
    const Ordering& ordering() const { return ordering_; }

    bool factorise(In theta, bool bare = false);  // Â + CᵀΘC, or M + CᵀΘC; false where rounding left it indefinite
    void solve(Out b);                            // b ← (L Lᵀ)⁻¹ b, (n·d)

    Vector contacts_ordered(In values) const;     // (k) from the given order
    Vector disks_ordered(In values) const;        // (n·d) from the given order
    Vector contacts_given(In ordered) const;     // and back
    Vector disks_given(In ordered) const;

private:
    void plan();

    Team& team_;
    Sizes sizes_;
    Ordering ordering_;
    Indices contact_;  // (k) the contact at each row, neighbours in memory as in the crowd
    Parts parts_;
    System system_, bare_;
    std::optional<Rows> rows_;
    std::optional<Fronts> fronts_;
    Vector made_;  // (k) kg, Θ of the factor in storage; empty where there is none
    bool made_bare_ = false;
};

}  // namespace nscd
