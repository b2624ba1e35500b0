//! Enumerations whose members carry a stable number and one sentence.
//!
//! The number goes over the link and into logs, so it never changes its meaning; the sentence is
//! what a person reads. Both stand in one place, and the sentence is the documentation too.

/// Declares such an enumeration: `Member = number, "sentence";`. Numbers stay below 64, so that a
/// set of members fits one word.
macro_rules! numbered {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $($member:ident = $number:literal, $sentence:literal;)+ }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum $name {
            $(#[doc = $sentence] $member = $number,)+
        }

        impl $name {
            /// Every member, by rising number.
            pub const ALL: &'static [Self] = &[$(Self::$member,)+];

            /// The stable number, as sent over the link and written to logs.
            #[must_use]
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// One sentence for a person.
            #[must_use]
            pub const fn sentence(self) -> &'static str {
                match self {
                    $(Self::$member => $sentence,)+
                }
            }

            /// The member with this number, if there is one.
            #[must_use]
            pub const fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$member),)+
                    _ => None,
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(self.sentence())
            }
        }
    };
}

/// Declares a set of members of a `numbered!` enumeration, one bit a number.
macro_rules! numbered_set {
    ($(#[$meta:meta])* $set:ident($bits:ty) of $member:ident) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $set(pub $bits);

        impl $set {
            /// The set without members.
            pub const EMPTY: Self = Self(0);

            const fn bit(member: $member) -> $bits {
                1 << (member.number() as u32 % <$bits>::BITS)
            }
            /// Whether `member` is in the set.
            #[must_use]
            pub const fn contains(self, member: $member) -> bool {
                self.0 & Self::bit(member) != 0
            }
            /// Whether there is no member.
            #[must_use]
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }
            /// Puts `member` in.
            pub fn insert(&mut self, member: $member) {
                self.0 |= Self::bit(member);
            }
            /// Puts `member` in where `present` holds.
            pub fn insert_if(&mut self, member: $member, present: bool) {
                if present {
                    self.insert(member);
                }
            }
            /// Members of either set.
            #[must_use]
            pub const fn union(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
            /// Members of `self` that `other` lacks.
            #[must_use]
            pub const fn without(self, other: Self) -> Self {
                Self(self.0 & !other.0)
            }
            /// The member with the lowest number.
            #[must_use]
            #[allow(clippy::cast_possible_truncation)]
            pub const fn first(self) -> Option<$member> {
                if self.0 == 0 { None } else { $member::from_number(self.0.trailing_zeros() as u8) }
            }
            /// The members, by rising number.
            pub fn iter(self) -> impl Iterator<Item = $member> {
                $member::ALL.iter().copied().filter(move |member| self.contains(*member))
            }
        }
    };
}

pub(crate) use {numbered, numbered_set};
