//! What the robot, the dongle, a board in a test and the host say to each other, and how it is framed.
//!
//! Messages are `postcard`. On a serial line each is a [`frame`]: [`lockstep`] lets a host run a plant against the controller
//! of a chip, [`dongle`] carries radio frames over the dongle's USB, [`pairing`] makes a robot obey a console. On the air each
//! is a frame of [`secure`], and [`radio`] says what is in it. Every decoder survives any bytes.

use postcard_schema::Schema;
use postcard_schema::key::Key;

pub mod dongle;
pub mod frame;
pub mod lockstep;
pub mod pairing;
pub mod radio;
pub mod secure;

/// Version of every message here: a hash of all their types, names included, and of the table of parameters. Ends that
/// differ in it do not talk.
pub const VERSION: u32 = {
    let mut hash = crate::parameters::table::fingerprint() ^ secure::LAYOUT;
    hash = mixed::<radio::Downlink>(hash);
    hash = mixed::<radio::Uplink>(hash);
    hash = mixed::<dongle::ToDongle>(hash);
    hash = mixed::<dongle::FromDongle>(hash);
    hash = mixed::<pairing::PairingRequest>(hash);
    hash = mixed::<pairing::PairingReply>(hash);
    hash = mixed::<lockstep::QuestionFrame>(hash);
    mixed::<lockstep::AnswerFrame>(hash)
};

/// Goes on from `hash` with a type's schema.
const fn mixed<T: Schema + ?Sized>(hash: u32) -> u32 {
    crate::parameters::table::fnv_1a(hash, &Key::for_path::<T>("scram").to_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Schema)]
    #[expect(dead_code, reason = "only its schema is looked at")]
    enum Message {
        One(u16),
        Two { value: f32 },
    }

    mod renamed {
        #[derive(postcard_schema::Schema)]
        #[expect(dead_code, reason = "only its schema is looked at")]
        pub enum Message {
            One(u16),
            Two { other: f32 },
        }
    }

    mod retyped {
        #[derive(postcard_schema::Schema)]
        #[expect(dead_code, reason = "only its schema is looked at")]
        pub enum Message {
            One(u32),
            Two { value: f32 },
        }
    }

    #[test]
    fn a_field_that_is_renamed_or_of_another_type_is_another_version() {
        let hash = mixed::<Message>(1);
        assert_ne!(mixed::<renamed::Message>(1), hash);
        assert_ne!(mixed::<retyped::Message>(1), hash);
        assert_eq!(mixed::<Message>(1), hash);
    }
}
