//! The fields of MCAP records (<https://mcap.dev/spec>), read without trust.
//!
//! The `mcap` crate parses whole and honest files; on damaged ones some of its paths index past the end or
//! subtract below zero. Here every field is asked for, and `None` is "the record is too short for it".

/// What is left of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn bytes(&mut self, length: u64) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(head)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.array().map(|[byte]| byte)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn str(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.bytes(length.into())?).ok()
    }

    /// One record inside a chunk: its opcode and content.
    pub(super) fn record(&mut self) -> Option<(u8, Fields<'a>)> {
        let opcode = self.u8()?;
        let length = self.u64()?;
        Some((opcode, Fields(self.bytes(length)?)))
    }
}

/// A schema's id and name; its content is for others' tools.
pub(super) fn schema(mut fields: Fields<'_>) -> Option<(u16, &str)> {
    Some((fields.u16()?, fields.str()?))
}

/// A channel without its metadata.
pub(super) struct ChannelRecord<'a> {
    pub(super) id: u16,
    pub(super) schema: u16,
    pub(super) topic: &'a str,
    pub(super) encoding: &'a str,
}

impl<'a> ChannelRecord<'a> {
    pub(super) fn parse(mut fields: Fields<'a>) -> Option<Self> {
        Some(Self { id: fields.u16()?, schema: fields.u16()?, topic: fields.str()?, encoding: fields.str()? })
    }
}

/// A message: which channel, when, what.
pub(super) struct MessageRecord<'a> {
    pub(super) channel: u16,
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

impl<'a> MessageRecord<'a> {
    pub(super) fn parse(mut fields: Fields<'a>) -> Option<Self> {
        let (channel, _sequence) = (fields.u16()?, fields.u32()?);
        let (log_time, _publish_time) = (fields.u64()?, fields.u64()?);
        Some(Self { channel, log_time, data: fields.0 })
    }
}

/// A chunk: compressed records and their checksum.
pub(super) struct ChunkRecord<'a> {
    pub(super) uncompressed_size: u64,
    pub(super) uncompressed_crc: u32,
    pub(super) compression: &'a str,
    pub(super) data: &'a [u8],
}

impl<'a> ChunkRecord<'a> {
    pub(super) fn parse(mut fields: Fields<'a>) -> Option<Self> {
        let (_start_time, _end_time) = (fields.u64()?, fields.u64()?);
        let (uncompressed_size, uncompressed_crc) = (fields.u64()?, fields.u32()?);
        let compression = fields.str()?;
        let length = fields.u64()?;
        Some(Self { uncompressed_size, uncompressed_crc, compression, data: fields.bytes(length)? })
    }
}
