//! What a robot's own simulation gets wrong, joint by joint.

mod excitation;

pub use excitation::{
    Excitation, ExcitationError, ExcitationSearch, FourierMotion, FourierSeries, JointLimits, JointMotion, PredictedParameter, RANDOM_MOTIONS, UsedLimits,
    excite,
};
