//! P1 to P10: what cannot be copied from the paper literally, and what is done instead.

/// One finding; its numbers are the claims whose ids begin with `prefix`.
pub struct Misprint {
    /// `P1`.
    pub number: &'static str,
    /// Beginning of the ids of its claims.
    pub prefix: &'static str,
    /// In a few words.
    pub title: &'static str,
    /// The mistake or the open question, and what is used instead.
    pub text: &'static str,
}

/// All of them.
pub const MISPRINTS: [Misprint; 10] = [
    Misprint {
        number: "P1",
        prefix: "p1-",
        title: "The sign of b in eq. (7)",
        text: "The matrix prints A(4,4) = +b/M. Equations (2) and (17) need −b/M, and −b/M is what runs.",
    },
    Misprint {
        number: "P2",
        prefix: "p2-",
        title: "r and r² in eq. (7)",
        text: "The matrix is consistent only for x₃ = x₂′/r, while eq. (6) says x₃ = x₂′. Equations (1)–(3) \
         and (16)–(18) run, in metres.",
    },
    Misprint {
        number: "P3",
        prefix: "p3-",
        title: "The motor's rating and its constants",
        text: "Rating and tables disagree about the back-EMF constant, and eq. (4) knows no gear, no rotor \
         and no amplifier. These are parameters here; for the paper's sets they stay at ratio 1, inertia 0 \
         and gain 1.",
    },
    Misprint {
        number: "P4",
        prefix: "p4-",
        title: "The lengths behind the stiffness",
        text: "The printed lengths do not give the printed digits. The printed stiffness is what runs.",
    },
    Misprint {
        number: "P5",
        prefix: "p5-",
        title: "Letters and references",
        text: "The table of parameters above puts the printed letter beside ours.",
    },
    Misprint {
        number: "P6",
        prefix: "p6-",
        title: "Table 3 at rest",
        text: "Inside its band the function cancels the torque, and so keeps the present speed. It is available here \
               as a labelled reproduction; the other solvers bring a body to rest and hold it there.",
    },
    Misprint {
        number: "P7",
        prefix: "p7-",
        title: "What position data determine",
        text: "Voltage and motor position determine the parameters only up to a common factor, and friction \
         by its totals. Table 4 is one choice among many.",
    },
    Misprint {
        number: "P8",
        prefix: "p8-",
        title: "Modes, and spans that follow the cart",
        text: "The paper gives no natural frequencies and keeps l₁ = l₂. Both modes follow from its equations.",
    },
    Misprint {
        number: "P9",
        prefix: "p9-",
        title: "Which voltage Table 2 was matched at",
        text: "Table 2 is called matched for 5 V. Beside Table 4 it fits 10 V. Measured curves could \
         decide; they are not available.",
    },
    Misprint {
        number: "P10",
        prefix: "p10-",
        title: "What holds for viscous friction only",
        text: "Some sentences of section 3 are properties of the linear model. Both models are given.",
    },
];
