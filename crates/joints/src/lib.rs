//! What a robot's own simulation gets wrong, joint by joint.
