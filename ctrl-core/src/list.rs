//! A list of at most `N` elements, without allocation.

use core::fmt;
use core::ops::{Deref, DerefMut};

/// At most `N` elements of a plain type; reads as a slice.
#[derive(Clone, Copy)]
pub struct List<T, const N: usize> {
    items: [T; N],
    len: usize,
}

impl<T: Copy, const N: usize> List<T, N> {
    /// No elements; `filler` takes the unused places.
    #[must_use]
    pub const fn empty(filler: T) -> Self {
        Self { items: [filler; N], len: 0 }
    }

    /// The elements of an array that fits; `filler` takes the unused places.
    #[must_use]
    pub const fn from_array<const M: usize>(elements: [T; M], filler: T) -> Self {
        const { assert!(M <= N, "more elements than the list has places") };
        let (mut items, mut place) = ([filler; N], 0);
        while place < M {
            items[place] = elements[place];
            place += 1;
        }
        Self { items, len: M }
    }
}

impl<T: Copy + Default, const N: usize> List<T, N> {
    /// No elements.
    #[must_use]
    pub fn new() -> Self {
        Self { items: [T::default(); N], len: 0 }
    }

    /// The elements of a slice, unless there are more than `N`.
    #[must_use]
    pub fn from_slice(items: &[T]) -> Option<Self> {
        let mut list = Self::new();
        list.items.get_mut(..items.len())?.copy_from_slice(items);
        list.len = items.len();
        Some(list)
    }

    /// The first `N` items at most; what follows is dropped.
    #[must_use]
    pub fn taking(items: impl Iterator<Item = T>) -> Self {
        let mut list = Self::new();
        for item in items {
            if list.push(item).is_err() {
                break;
            }
        }
        list
    }

    /// Adds an element at the end.
    ///
    /// # Errors
    /// Returns the element when the list is full.
    pub fn push(&mut self, item: T) -> Result<(), T> {
        match self.items.get_mut(self.len) {
            Some(place) => {
                *place = item;
                self.len += 1;
                Ok(())
            }
            None => Err(item),
        }
    }

    /// Removes the elements from the `len`-th on.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }
}

impl<T: Copy + Default, const N: usize> Default for List<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, const N: usize> Deref for List<T, N> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        self.items.get(..self.len).unwrap_or(&self.items)
    }
}

impl<T, const N: usize> DerefMut for List<T, N> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        let len = self.len.min(N);
        &mut self.items[..len]
    }
}

impl<T: fmt::Debug, const N: usize> fmt::Debug for List<T, N> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(out)
    }
}

impl<T: PartialEq, const N: usize> PartialEq for List<T, N> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<'a, T, const N: usize> IntoIterator for &'a mut List<T, N> {
    type Item = &'a mut T;
    type IntoIter = core::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<'a, T, const N: usize> IntoIterator for &'a List<T, N> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// As a sequence of at most `N` elements.
#[cfg(feature = "serde")]
mod wire {
    use core::fmt;
    use core::marker::PhantomData;

    use serde::de::{Error, SeqAccess, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::List;

    impl<T: Serialize, const N: usize> Serialize for List<T, N> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self.iter())
        }
    }

    impl<'de, T: Copy + Default + Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_seq(Elements(PhantomData))
        }
    }

    struct Elements<T, const N: usize>(PhantomData<T>);

    impl<'de, T: Copy + Default + Deserialize<'de>, const N: usize> Visitor<'de> for Elements<T, N> {
        type Value = List<T, N>;

        fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(out, "at most {N} elements")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<List<T, N>, A::Error> {
            let mut list = List::new();
            while let Some(element) = elements.next_element()? {
                list.push(element).map_err(|_| A::Error::invalid_length(N + 1, &self))?;
            }
            Ok(list)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::List;

    #[test]
    fn it_holds_what_fits_and_returns_the_rest() {
        let mut list = List::<u8, 2>::new();
        assert!(list.is_empty());
        assert_eq!((list.push(1), list.push(2), list.push(3)), (Ok(()), Ok(()), Err(3)));
        assert_eq!(*list, [1, 2]);
        list[0] = 9;
        assert_eq!(List::from_slice(&[9, 2]), Some(list));
        assert_eq!(List::<u8, 2>::from_slice(&[1, 2, 3]), None);
        const ONE: List<u8, 2> = List::from_array([7], 0);
        assert_eq!(*ONE, [7]);
        list.truncate(0);
        assert_eq!(list, List::default());
    }

    #[test]
    #[cfg(feature = "serde")]
    fn it_reads_as_a_sequence_of_bounded_length() {
        use std::string::ToString;
        let read = |text: &str| serde_json::from_str::<List<u8, 2>>(text);
        let two = List::from_slice(&[1, 2]).unwrap();
        assert_eq!(read("[1, 2]").unwrap(), two);
        assert_eq!(serde_json::to_string(&two).unwrap(), "[1,2]");
        assert!(read("[1, 2, 3]").unwrap_err().to_string().contains("at most 2 elements"));
    }
}
