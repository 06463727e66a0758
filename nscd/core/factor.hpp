// The Cholesky factor of Â + CᵀΘC: by rows for small crowds, by fronts for large ones.
#pragma once

#include <optional>

#include "cholesky_fronts.hpp"
#include "cholesky_rows.hpp"

namespace nscd {

// What may be set otherwise in tests.
struct Sizes {
    int multifrontal = 1500;      // from this many disks on the multifrontal factorisation is the faster one (see benchmarks)
    int shared = SHARED;  // from this many disks on threads work on parts of a crowd
    int leaf = 8;         // parts of up to so many disks are not cut further
};

class Factor {
public:
    // Order the disks of a problem. reusable: the order of a crowd, of which these are disks `disk`.
    Factor(const ImpactProblem& problem, Team& team, const Sizes& sizes, ReusableOrder* reusable = nullptr, std::span<const Index> disk = {});

    const ImpactProblem& problem() const { return problem_; }  // the problem in elimination order
    const Parts& parts() const { return parts_; }
    Team& team() const { return team_; }
    const Ordering& ordering() const { return ordering_; }

    bool factorise(In theta, bool mass_only = false);  // Â + CᵀΘC, or M + CᵀΘC; false where rounding left it indefinite
    void solve(Out b);                            // b ← (L Lᵀ)⁻¹ b, (n·d)

    Vector contacts_in_elimination_order(In values) const;  // (k) from the given order
    Vector disks_in_elimination_order(In values) const;  // (n·d) from the given order
    Vector contacts_in_input_order(In ordered) const;  // and back
    Vector disks_in_input_order(In ordered) const;

private:
    void plan();

    Team& team_;
    Sizes sizes_;
    Ordering ordering_;
    Indices contact_;  // (k) the contact at each row, neighbours in memory as in the crowd
    Parts parts_;
    ImpactProblem problem_, mass_only_;
    std::optional<Rows> rows_;
    std::optional<Fronts> fronts_;
    Vector factored_theta_;  // (k) kg, Θ of the factor in storage; empty where there is none
    bool factored_mass_only_ = false;
};

}  // namespace nscd
